#pragma once
/// Adam (Kingma and Ba 2015) on ellipsoids, in each one's own frame.

#include <array>
#include <span>
#include <vector>

#include "esvr/kernel.h"
#include "fit/ellipsoid.h"

namespace esvr {

/// Largest step a parameter takes in one iteration.
struct StepSizes {
  double position = 0.1;   ///< of the semi-axis's scale
  double shape = 0.1;      ///< relative change of a scale; the same for shears
  double intensity = 0.1;  ///< of the intensity, at least of kIntensityFloor
  [[nodiscard]] ESVR_HD StepSizes scaled(double f) const {
    return {position * f, shape * f, intensity * f};
  }
};

struct AdamOptions {
  double beta1 = 0.9;
  double beta2 = 0.95;  ///< short: the loss has no noise to average out
};

/// First and second moments of one ellipsoid's gradient.
struct AdamState {
  std::array<float, kParameters> m{}, v{};
  std::uint32_t steps = 0;  ///< since the ellipsoid was placed
};

/// What a step may lead to.
struct EllipsoidLimits {
  double smallestScale, largestScale;        ///< voxels
  double lowestIntensity, highestIntensity;  ///< in units of the target
};

/// What a pass tells of one ellipsoid.
struct EllipsoidGradient {
  ParameterVector byParameter;  ///< of half the sum of squared residuals, or of the given loss
  double phi2;                  ///< sum over voxels of phi^2: the curvature by intensity
  double byKappa;               ///< the kernel's edge, the scales held
};

/// One step of every ellipsoid.
void adamStep(std::span<Ellipsoid> ellipsoids, std::span<AdamState> states,
              std::span<const EllipsoidGradient> gradients, const StepSizes& sizes,
              const AdamOptions& options, const EllipsoidLimits& limits);

}  // namespace esvr
