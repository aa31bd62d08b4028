#pragma once
/// Levels of thresholds (esvr/block_levels.h) as the content of a section.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/block_levels.h"
#include "esvr/coord.h"

namespace esvr::format {

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
