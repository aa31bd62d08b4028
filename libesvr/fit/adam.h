#pragma once
/// Adam (Kingma and Ba 2015) on the parameters of ellipsoids, each in its own frame.

#include <array>
#include <span>
#include <vector>

#include "esvr/fit.h"
#include "fit/ellipsoid.h"

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

/// The derivatives of one ellipsoid.
struct EllipsoidGradient {
  ParameterVector byParameter;  ///< gradient of half the sum of squares, or of a given loss
  double phi2;                  ///< sum over voxels of phi^2: second derivative by the intensity
  double byKappa;               ///< derivative by the kernel's edge at fixed scales
};

/// What a step of Adam needs besides the ellipsoids and their gradients.
struct AdamStep {
  StepSizes sizes;
  AdamOptions options;
  EllipsoidLimits limits;
};

/// Takes one step with every ellipsoid.
void adamStep(std::span<Ellipsoid> ellipsoids, std::span<AdamState> states,
              std::span<const EllipsoidGradient> gradients, const AdamStep& step);

}  // namespace esvr
