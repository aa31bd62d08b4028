#pragma once
/// The exact mask of active voxels as the content of a section.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/sparse_volume.h"

namespace esvr::format {

struct Mask {
  std::vector<Coord> leaves;  ///< index corners of bricks, increasing
  std::vector<BrickMask> active;
};

/// \throws RuntimeFailure  corners that are none, not increasing, too far apart
[[nodiscard]] std::vector<std::byte> putMask(std::span<const Coord> leaves,
                                             std::span<const BrickMask> active);

/// \throws BadInput  damaged; begins with `where`; MemoryExceeded: the budget holds fewer bricks
[[nodiscard]] Mask getMask(std::span<const std::byte> content, const std::string& where,
                           MemoryBudget& budget);

}  // namespace esvr::format
