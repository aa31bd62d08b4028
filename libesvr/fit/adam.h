#pragma once
/// Adam (Kingma and Ba 2015) on the parameters of ellipsoids, each in its own frame. The step of
/// one ellipsoid is for host and device.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "fit/ellipsoid.h"
#include "fit/gradient.h"

namespace esvr {

/// Largest steps of the parameters in one iteration.
struct StepSizes {
  double position = 0.1;   ///< motion along an axis, in its scale
  double shape = 0.1;      ///< relative change of a scale, and shear
  double intensity = 0.1;  ///< relative change of the intensity (see largestStep)
  [[nodiscard]] ESVR_HD StepSizes scaled(double f) const {
    return {position * f, shape * f, intensity * f};
  }
};

struct AdamOptions {
  double beta1 = 0.9;
  double beta2 = 0.95;  ///< a short average, since the loss has no noise
};

/// First and second moments of one ellipsoid's gradient.
struct AdamState {
  std::array<float, kParameters> m{}, v{};
  std::uint32_t steps = 0;  ///< steps since the ellipsoid was placed
};

/// Limits of the parameters.
struct EllipsoidLimits {
  double smallestScale, largestScale;        ///< voxels
  double lowestIntensity, highestIntensity;  ///< units of the target
};

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

/// What a step of Adam needs besides the ellipsoids and their gradients.
struct AdamStep {
  StepSizes sizes;
  AdamOptions options;
  EllipsoidLimits limits;
};

/// Takes one step with every ellipsoid, on the CPU.
void adamStep(std::span<Ellipsoid> ellipsoids, std::span<AdamState> states,
              std::span<const EllipsoidGradient> gradients, const AdamStep& step);

}  // namespace esvr
