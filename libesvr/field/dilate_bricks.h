#pragma once
/// Grows a set of bricks by one in every direction.

#include <span>
#include <vector>

#include "esvr/coord.h"

namespace esvr {

/// \param bricks  in strictly increasing order
/// \return the bricks and their 26 neighbours each, in strictly increasing order
[[nodiscard]] std::vector<Coord> dilateBricks(std::span<const Coord> bricks);

}  // namespace esvr
