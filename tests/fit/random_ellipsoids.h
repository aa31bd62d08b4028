#pragma once
/// Random volumes and ellipsoids for the tests of gradients and steps, and their sum in float64, by
/// its definition.

#include <vector>

#include "../field/random_field.h"
#include "esvr/ellipsoids.h"
#include "esvr/volume.h"
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

/// m of an ellipsoid at a voxel: |L (v - mu)|^2.
inline double squaredDistance(const Ellipsoid& p, Coord v) {
  const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
  const double* row =
      p.L.data();  // tests are not optimised, and each use of an array would be a call
  double m = 0.0;
  for (int r = 0; r < 3; ++r, row += 3) {
    const double u = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
    m += u * u;
  }
  return m;
}

inline double sumAt(const std::vector<Ellipsoid>& ellipsoids, const KernelConstants<double>& k,
                    Coord v) {
  double sum = 0.0;
  for (const Ellipsoid& p : ellipsoids) sum += p.intensity * kernelPhi(k, squaredDistance(p, v));
  return sum;
}

}  // namespace esvr::test
