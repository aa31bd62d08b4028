#include "codec/motion_search.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace esvr::codec {
namespace {

/// Sum of distances, in codes, that coding another motion than the expected one is worth.
constexpr double kMotionPrice = 12.0;

bool isPossible(Coord motion) {
  return std::max({std::abs(motion.x), std::abs(motion.y), std::abs(motion.z)}) <= kLargestMotion;
}

constexpr Coord kSteps[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

}  // namespace

Coord MotionSearch::find(Coord brick, std::span<const std::int32_t> codes, Coord expected) {
  past_.fill(brick, {}, *cube_);
  Coord best = expected;
  double least = costOf(best, codes, expected);
  const auto consider = [&](Coord motion) {
    if (!isPossible(motion)) return false;
    const double cost = costOf(motion, codes, expected);
    if (cost >= least) return false;
    least = cost, best = motion;
    return true;
  };
  consider({});
  for (bool better = least > 0.0; better;) {
    better = false;
    const Coord from = best;
    for (const Coord step : kSteps) better = consider(from + step) || better;
  }
  return best;
}

double MotionSearch::costOf(Coord motion, std::span<const std::int32_t> codes,
                            Coord expected) const {
  using Cube = PastCube<kLargestMotion>;
  double sum = motion == expected ? 0.0 : kMotionPrice;
  const std::int32_t* code = codes.data();
  for (int x = 0; x < kBrickSide; ++x)
    for (int y = 0; y < kBrickSide; ++y) {
      const double* place = &cube_->place[Cube::cell(Coord{x, y, 0} - motion)];
      for (int z = 0; z < kBrickSide; ++z) sum += std::abs(double(*code++) - place[z]);
    }
  return sum;
}

}  // namespace esvr::codec
