#pragma once
/// Volumes that suit voxels or ellipsoids.

#include <array>
#include <cmath>

#include "../fit/volumes.h"

namespace esvr::test {

/// Noise, which no sum of fewer ellipsoids than voxels approximates.
inline SparseVolume noiseVolume(int bricks) {
  Random random(3);
  return volumeOf({}, bricks, 0.0f, [&](Coord) { return float(random(0.5, 1.0)); });
}

/// Sixteen blobs that are a few voxels wide. \param moved  voxels by which they have moved along x
inline SparseVolume smoothVolume(double moved = 0.0) {
  Random random(5);
  std::array<std::array<double, 4>, 16> blobs;  // center and width
  for (auto& [x, y, z, width] : blobs)
    x = random(5, 43) + moved, y = random(5, 43), z = random(5, 43), width = random(3, 6);
  return volumeOf({}, 6, 0.0f, [&](Coord v) {
    double sum = 0.0;
    for (const auto& [x, y, z, width] : blobs)
      sum += std::exp(-((v.x - x) * (v.x - x) + (v.y - y) * (v.y - y) + (v.z - z) * (v.z - z)) /
                      (2.0 * width * width));
    return float(sum);
  });
}

}  // namespace esvr::test
