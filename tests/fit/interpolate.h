#pragma once
/// Interpolation between voxels in float64, for tests.

#include <cmath>
#include <cstdint>

#include "esvr/coord.h"
#include "fit/offset.h"

namespace esvr::test {

/// Trilinear interpolation at a voxel, moved by an offset. \param at  the value of a voxel
template <class At>
double interpolate(const Offset& offset, Coord v, const At& at) {
  const double place[3] = {v.x + offset[0], v.y + offset[1], v.z + offset[2]};
  Coord low;
  double weight[3];
  std::int32_t* const lows[3] = {&low.x, &low.y, &low.z};
  for (int a = 0; a < 3; ++a) {
    *lows[a] = std::int32_t(std::floor(place[a]));
    weight[a] = place[a] - *lows[a];
  }
  double sum = 0.0;
  for (int n = 0; n < 8; ++n) {
    const int x = n >> 2, y = n >> 1 & 1, z = n & 1;
    sum += (x ? weight[0] : 1.0 - weight[0]) * (y ? weight[1] : 1.0 - weight[1]) *
           (z ? weight[2] : 1.0 - weight[2]) * at(low + Coord{x, y, z});
  }
  return sum;
}

}  // namespace esvr::test
