#pragma once
/// The positions of bricks as the content of a section: one array for each axis.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "esvr/coord.h"

namespace esvr::format {

/// \throws RuntimeFailure  the corners are not multiples of 8, or not increasing
void requireBricks(std::span<const Coord> corners);

/// \throws RuntimeFailure  as requireBricks
[[nodiscard]] std::vector<std::byte> putBricks(std::span<const Coord> corners);

/// \throws BadInput  the content is not a list of increasing corners; the text begins with `where`
[[nodiscard]] std::vector<Coord> getBricks(std::span<const std::byte> content,
                                           const std::string& where);

}  // namespace esvr::format
