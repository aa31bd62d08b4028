#pragma once
/// Complete pictures as PNG files.

#include <string>

#include "render/view/painting.h"
#include "render/view/requests.h"

namespace esvr::view {

/// Draws the answer to "png": the file that esvr-render writes for the scene, with the command in its
/// metadata.
/// \param drawables  as in Painting::Input
/// \throws Error  as for Painting
[[nodiscard]] std::string pngMessage(const Collection& collection, Drawables& drawables,
                                     const PictureRequest& request, const CancelToken& cancel);

}  // namespace esvr::view
