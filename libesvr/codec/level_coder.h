#pragma once
/// Codes the levels of thresholds of a grid (docs/format.md, "Levels"). A block usually has the level of
/// a block beside it.

#include <cstdint>
#include <vector>

#include "codec/range_coder.h"
#include "esvr/ellipsoids.h"
#include "esvr/volume.h"

namespace esvr::codec {

/// Bricks and the levels of their blocks.
struct LevelBricks {
  std::vector<Coord> bricks;  ///< positions in bricks, increasing
  std::vector<BlockLevels> levels;
};

/// Writes levels. All bricks must be less than 2^21 bricks above the origin along each axis.
void codeLevels(Writer& side, const LevelBricks& levels);

/// \param maxBricks  largest number of bricks
/// \throws BadInput  there are more of these, a brick is there twice, or a level is out of range
[[nodiscard]] LevelBricks codeLevels(Reader& side, std::uint64_t maxBricks);

}  // namespace esvr::codec
