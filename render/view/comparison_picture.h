#pragma once
/// Pictures that show a grid and its reference together.

#include "esvr/image.h"
#include "render/view/scene_json.h"

namespace esvr::view {

/// The picture that a comparison asks for. Differences are those of each channel in front of black,
/// and opaque.
/// \param image, reference  of the same size
[[nodiscard]] Image comparisonPicture(const Image& image, const Image& reference,
                                      const Comparison& comparison);

}  // namespace esvr::view
