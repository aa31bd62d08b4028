#pragma once
/// The sum of ellipsoids in float64, by its definition.

#include <vector>

#include "esvr/coord.h"
#include "esvr/kernel.h"
#include "fit/ellipsoid.h"

namespace esvr::test {

/// m of an ellipsoid at a voxel: |L (v - mu)|^2.
inline double squaredDistance(const Ellipsoid& p, Coord v) {
  const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
  double m = 0.0;
  for (int r = 0; r < 3; ++r) {
    const double u = p.L[3 * r] * d[0] + p.L[3 * r + 1] * d[1] + p.L[3 * r + 2] * d[2];
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
