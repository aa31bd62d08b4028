#pragma once
/// A mask of active voxels as the content of a section.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/sparse_volume.h"

namespace esvr::format {

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

}  // namespace esvr::format
