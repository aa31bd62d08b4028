#pragma once
/// The sections that say where voxels are active: the positions of bricks, and masks.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/volume.h"

namespace esvr::format {

// ---- Positions of bricks: one array for each axis

/// \throws RuntimeFailure  the corners are not multiples of 8, or not increasing
void requireBricks(std::span<const Coord> corners);

/// \throws RuntimeFailure  as requireBricks
[[nodiscard]] std::vector<std::byte> putBricks(std::span<const Coord> corners);

/// \throws BadInput  the content is not a list of increasing corners; the text begins with `where`
[[nodiscard]] std::vector<Coord> getBricks(std::span<const std::byte> content,
                                           const std::string& where);

// ---- Masks of active voxels

struct Mask {
  std::vector<Coord> bricks;  ///< index corners of the bricks, increasing
  std::vector<BrickMask> active;
};

/// \throws RuntimeFailure  the corners are not multiples of 8, not increasing, or too far apart
[[nodiscard]] std::vector<std::byte> putMask(std::span<const Coord> bricks,
                                             std::span<const BrickMask> active);

/// \throws BadInput  the content is damaged; the text begins with `where`
/// \throws MemoryExceeded  there are more bricks than the budget allows
[[nodiscard]] Mask getMask(std::span<const std::byte> content, const std::string& where,
                           MemoryBudget& budget);

}  // namespace esvr::format
