#pragma once
/// The answer to "describe": what the server shows.

#include <string>

#include "render/view/collection.h"

namespace esvr::view {

/// \param device  the name of the device that draws
[[nodiscard]] std::string descriptionMessage(const Collection& collection,
                                             const std::string& device);

}  // namespace esvr::view
