#pragma once
/// How a solid fades out at its surface.

#include <algorithm>

namespace esvr::samples {

/// 1 where distance <= -edge / 2, 0 where distance >= edge / 2, smooth between.
/// \param distance  to the surface, negative inside
inline float softEdge(double distance, double edge) {
  const double t = std::clamp(0.5 - distance / edge, 0.0, 1.0);
  return float(t * t * (3.0 - 2.0 * t));
}

}  // namespace esvr::samples
