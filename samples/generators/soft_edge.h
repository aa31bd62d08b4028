#pragma once
/// The soft edge of a solid.

#include <algorithm>

namespace esvr::samples {

/// 1 for distance <= -edge / 2, 0 for distance >= edge / 2, and smooth between.
/// \param distance  distance to the surface, negative inside
inline float softEdge(double distance, double edge) {
  const double t = std::clamp(0.5 - distance / edge, 0.0, 1.0);
  return float(t * t * (3.0 - 2.0 * t));
}

}  // namespace esvr::samples
