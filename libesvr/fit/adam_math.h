#pragma once
/// Adam's step of one ellipsoid, for host and device.

#include <algorithm>
#include <cmath>

#include "fit/adam.h"
#include "fit/ellipsoid_math.h"

namespace esvr {

/// The factors of Adam's direction, whose components are about 1 at most.
ESVR_HD inline ParameterVector largestStep(const Ellipsoid& p, const StepSizes& s) {
  // lets intensities near zero move; units of the target, whose largest magnitude is 1
  constexpr double kIntensityFloor = 0.01;
  const double magnitude = std::abs(p.intensity);
  const double i = s.intensity * (magnitude > kIntensityFloor ? magnitude : kIntensityFloor);
  return {s.position, s.position, s.position, s.shape, s.shape,
          s.shape,    s.shape,    s.shape,    s.shape, i};
}

/// Updates the moments and returns the step, `largest` times Adam's direction.
ESVR_HD inline ParameterVector adamDirection(AdamState& state, const ParameterVector& gradient,
                                             const AdamOptions& o, const ParameterVector& largest) {
  // The squares of smaller gradients vanish in float32; this avoids a division by zero.
  constexpr double kEpsilon = 1e-18;
  ++state.steps;
  const double c1 = 1.0 / (1.0 - std::pow(o.beta1, double(state.steps)));
  const double c2 = 1.0 / (1.0 - std::pow(o.beta2, double(state.steps)));
  ParameterVector d;
  for (int k = 0; k < kParameters; ++k) {
    const double g = gradient[k];
    state.m[k] = float(o.beta1 * state.m[k] + (1.0 - o.beta1) * g);
    state.v[k] = float(o.beta2 * state.v[k] + (1.0 - o.beta2) * g * g);
    d[k] = -largest[k] * c1 * state.m[k] / (std::sqrt(c2 * state.v[k]) + kEpsilon);
  }
  return d;
}

/// Takes a step and clamps the parameters to the limits.
ESVR_HD inline void moveWithin(Ellipsoid& p, const ParameterVector& step,
                               const EllipsoidLimits& limits) {
  applyStep(p, step);
  p.intensity = std::clamp(p.intensity, limits.lowestIntensity, limits.highestIntensity);
  clampScales(p, limits.smallestScale, limits.largestScale);
}

}  // namespace esvr
