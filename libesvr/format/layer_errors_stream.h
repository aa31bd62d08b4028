#pragma once
/// The errors of the importance layers as the content of a section.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::format {

[[nodiscard]] std::vector<std::byte> putLayerErrors(std::span<const LayerError> errors);

/// \throws BadInput  there is not one error for each of `layers`, or one is not a number; the text
///                   begins with `where`
[[nodiscard]] std::vector<LayerError> getLayerErrors(std::span<const std::byte> content,
                                                     std::size_t layers, const std::string& where);

}  // namespace esvr::format
