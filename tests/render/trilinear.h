#pragma once
/// Trilinear interpolation in float64.

#include <cmath>

#include "esvr/render.h"
#include "esvr/sparse_volume.h"

namespace esvr::test {

inline double trilinear(const SparseVolume& volume, const Vec3& place) {
  const Coord low{int(std::floor(place[0])), int(std::floor(place[1])), int(std::floor(place[2]))};
  const double x = place[0] - low.x, y = place[1] - low.y, z = place[2] - low.z;
  double value = 0.0;
  for (int c = 0; c < 8; ++c) {
    const Coord step{c >> 2, (c >> 1) & 1, c & 1};
    const double weight = (step.x ? x : 1.0 - x) * (step.y ? y : 1.0 - y) * (step.z ? z : 1.0 - z);
    value += weight * double(valueAt(volume, low + step));
  }
  return value;
}

}  // namespace esvr::test
