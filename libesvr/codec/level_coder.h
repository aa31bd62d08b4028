#pragma once
/// Codes the levels of thresholds of a grid (docs/format.md, "Levels"). A block usually has the level of
/// the previous frame, or of a block beside it.

#include <cstdint>
#include <vector>

#include "codec/symbol_coder.h"
#include "esvr/block_levels.h"
#include "esvr/coord.h"

namespace esvr::codec {

/// Bricks and the levels of their blocks.
struct LevelBricks {
  std::vector<Coord> bricks;  ///< positions in bricks, increasing
  std::vector<BlockLevels> levels;
};

/// Writes levels. All bricks must be less than 2^21 bricks above the origin along each axis.
/// \param past  levels of the previous frame, in the same coordinates; without bricks if there are none
void codeLevels(Writer& side, const LevelBricks& past, const LevelBricks& levels);

/// \param maxNew  largest number of bricks that neither are in the previous frame nor touch it
/// \throws BadInput  there are more of these, a brick is there twice, or a level is out of range
[[nodiscard]] LevelBricks codeLevels(Reader& side, const LevelBricks& past, std::uint64_t maxNew);

/// The number of bricks of `levels` that the previous frame has not.
[[nodiscard]] std::uint64_t newBricks(const LevelBricks& past, const LevelBricks& levels);

}  // namespace esvr::codec
