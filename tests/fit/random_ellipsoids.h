#pragma once
/// Random volumes and ellipsoids for the tests of gradients and steps.

#include <vector>

#include "../field/random_field.h"
#include "esvr/sparse_volume.h"
#include "fit/ellipsoid.h"

namespace esvr::test {

inline constexpr int kSide = 32;  // voxels

inline SparseVolume denseVolume() {
  std::vector<BrickInput> bricks;
  Random random(5);
  for (int b = 0; b < 64; ++b) {
    BrickInput brick;
    brick.corner = Coord{b / 16, b / 4 % 4, b % 4} * kBrickSide;
    for (float& v : brick.values) v = float(random(0.0, 1.0));
    brick.active.setAll();
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), 0.0f);
}

inline std::vector<Ellipsoid> randomEllipsoids(std::size_t n, double smallest, double aspect) {
  const Field field = randomField(
      {.count = n, .extent = kSide, .smallest = smallest, .aspect = aspect, .seed = 21});
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  std::vector<Ellipsoid> ellipsoids;
  for (std::size_t i = 0; i < n; ++i)
    ellipsoids.push_back(
        {{e.center[0][i], e.center[1][i], e.center[2][i]}, unitFrame(e, i), e.intensity[i]});
  return ellipsoids;
}

}  // namespace esvr::test
