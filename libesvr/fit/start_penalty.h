#pragma once
/// A penalty on the distance of an ellipsoid from its start, for host and device.
///
/// Many changes of an ellipsoid hardly change the sum, since its neighbours make up for them, and
/// Adam makes such changes with steps of full size. The frames of a sequence store differences from
/// the start, where each change costs bits. With the displacement d = L (mu - mu0), the deformation
/// M = (1 - L L0^-1 + its transpose) / 2 and the weight w, the loss 1/2 sum r^2 gets
///
///     w/2 sum phi^2 (I^2 |d|^2 + I^2 |M|^2 + (I - I0)^2)
///
/// whose factors sum phi^2 and I^2 are taken as constants. They make the penalty of a step about w
/// times what the step would change of the sum if there were no neighbours.

#include "fit/adam.h"
#include "fit/ellipsoid_math.h"

namespace esvr {

/// The gradient by a step of the ellipsoid without sum phi^2 and w. It is that of the penalty to
/// first order in M.
[[nodiscard]] ESVR_HD inline ParameterVector distanceFromStart(const Ellipsoid& p,
                                                               const Ellipsoid& start) {
  using namespace ellipsoid_math;
  const Matrix3d L = asEigen(p.L);
  const Matrix3 F = inverse(start.L);
  const Matrix3d change = Matrix3d::Identity() - L * asEigen(F);
  const Eigen::Vector3d moved(p.center[0] - start.center[0], p.center[1] - start.center[1],
                              p.center[2] - start.center[2]);
  const Eigen::Vector3d d = L * moved;
  const double square = p.intensity * p.intensity;
  const auto shear = [&](int j, int k) { return square * (change(j, k) + change(k, j)); };
  return {square * d[0],         square * d[1],
          square * d[2],         square * change(0, 0),
          square * change(1, 1), square * change(2, 2),
          shear(0, 1),           shear(0, 2),
          shear(1, 2),           p.intensity - start.intensity};
}

/// The gradient of the loss with the penalty.
[[nodiscard]] ESVR_HD inline ParameterVector penalised(const EllipsoidGradient& gradient,
                                                       const Ellipsoid& p, std::uint32_t start,
                                                       const StartPenalty& penalty) {
  ParameterVector g = gradient.byParameter;
  if (penalty.weight == 0.0 || start == kNoStart) return g;
  const ParameterVector distance = distanceFromStart(p, penalty.starts[start]);
  for (int k = 0; k < kParameters; ++k) g[k] += penalty.weight * gradient.phi2 * distance[k];
  return g;
}

}  // namespace esvr
