#pragma once
/// The sections that say where voxels are active: the positions of bricks, masks, and levels of thresholds
/// (esvr/ellipsoids.h).

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/ellipsoids.h"
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

/// The previous mask, moved as the mask of a frame has moved since: what the voxels of the frame are
/// predicted to be.
/// \return masks of the bricks of the frame; empty if its mask lies too far from the previous one
[[nodiscard]] std::vector<BrickMask> movedMask(const Mask& mask, const Mask& previous);

// ---- Levels of thresholds

/// Bricks and the levels of their blocks.
struct Levels {
  std::vector<Coord> bricks;  ///< index corners of the bricks, increasing
  std::vector<BlockLevels> levels;
};

/// True if bricks lie near enough to each other for their levels to be stored: less than 2^24 voxels.
[[nodiscard]] bool areNear(std::span<const Coord> corners);

/// \throws RuntimeFailure  the corners are not multiples of 8, not increasing, or not near
[[nodiscard]] std::vector<std::byte> putLevels(const Levels& levels);

/// \throws BadInput  the content is damaged; the text begins with `where`
/// \throws MemoryExceeded  the content may hold more bricks than the budget allows
[[nodiscard]] Levels getLevels(std::span<const std::byte> content, const std::string& where,
                               MemoryBudget& budget);

}  // namespace esvr::format
