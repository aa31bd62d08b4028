#pragma once
/// Corners of bricks as bytes of a section: brick positions, one array an axis.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "esvr/coord.h"

namespace esvr::format {

/// \throws RuntimeFailure  corners that are not multiples of 8 or not increasing
void requireLeaves(std::span<const Coord> corners);

/// \throws RuntimeFailure  as requireLeaves
[[nodiscard]] std::vector<std::byte> putLeaves(std::span<const Coord> corners);

/// \throws BadInput  not a list of increasing corners; begins with `where`
[[nodiscard]] std::vector<Coord> getLeaves(std::span<const std::byte> content,
                                           const std::string& where);

}  // namespace esvr::format
