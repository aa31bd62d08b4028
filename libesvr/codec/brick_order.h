#pragma once
/// The order in which the voxel coder visits bricks.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "esvr/coord.h"

namespace esvr::codec {

/// The Morton key of a brick, whose coordinates are not negative.
[[nodiscard]] std::uint64_t keyOf(Coord brick);
[[nodiscard]] Coord brickAt(std::uint64_t key);

/// The bricks in Morton order, in which no brick comes before one that is lower along every axis.
[[nodiscard]] std::vector<std::size_t> codingOrder(const std::vector<Coord>& bricks);

}  // namespace esvr::codec
