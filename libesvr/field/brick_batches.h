#pragma once
/// Evaluates a field over any number of bricks with a buffer of bounded size.

#include <cstddef>
#include <functional>
#include <span>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"

namespace esvr {

/// Number of bricks that are evaluated at once. Their values take 32 MB.
inline constexpr std::size_t kBatchBricks = 16384;

/// A function of a brick's index corner and its kBrickVoxels values, which it may change.
using BrickVisitor = std::function<void(Coord, std::span<float>)>;

/// Calls `visit` for every brick, in order, from the calling thread.
void forEachBrick(const Field& field, std::span<const Coord> corners, const BrickVisitor& visit);

}  // namespace esvr
