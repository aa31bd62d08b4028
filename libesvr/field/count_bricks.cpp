#include "field/count_bricks.h"

#include <algorithm>
#include <string>

#include "esvr/error.h"
#include "field/brick_set.h"
#include "field/brick_walk.h"

namespace esvr {
namespace {

double determinant(const Matrix3& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// The bricks' middles lie between three pairs of planes (SlabTest). Around each middle lies a cube
/// as large as a brick, and the cubes do not overlap: their number is bounded by the volume between
/// planes that are moved outwards by half a brick.
double bricksBetweenSlabs(const Support& s) {
  constexpr double kHalf = kBrickSide / 2.0, kBrickVolume = kBrickVoxels;
  double volume = 8.0 / std::abs(determinant(s.L));
  for (int j = 0; j < 3; ++j) {
    const double* row = &s.L[3 * j];
    const double reach = std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]);
    volume *= slabBound(s, j) + kHalf * reach;
  }
  return volume / kBrickVolume;
}

}  // namespace

double maxBricks(const Support& support, const Box& within) {
  const double boxed = common(brickRange(support), within).volume();
  const double slabs = bricksBetweenSlabs(support);
  return slabs < boxed ? slabs : boxed;
}

double countBricks(std::span<const Support> supports, const Box& within, double enough) {
  constexpr std::int32_t kSlice = 64;  // bricks along x between two checks of the count
  BrickSet set;
  for (const Support& support : supports) {
    Box left = common(brickRange(support), within);
    for (; !left.empty() && double(set.size()) <= enough; left.min.x += kSlice) {
      Box slice = left;
      slice.max.x = std::min(left.max.x, left.min.x + kSlice - 1);
      forEachReachedBrick(support, slice, [&](Coord brick) { set.insert(brick); });
    }
  }
  return double(set.size());
}

void requireListable(std::span<const Support> supports, const Box& within) {
  constexpr double kMaxListed = 0x1p32;
  double bricks = 0.0;
  for (const Support& support : supports) bricks += maxBricks(support, within);
  if (bricks > kMaxListed)
    throw MemoryExceeded("the ellipsoids reach up to " + std::to_string(bricks) +
                         " bricks, more than 2^32");
}

}  // namespace esvr
