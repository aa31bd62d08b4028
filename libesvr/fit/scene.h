#pragma once
/// Values that a fit derives from its target on any device.

#include <algorithm>
#include <cmath>

#include "fit/adam.h"
#include "fit/sampling_options.h"
#include "fit/target.h"
#include "fit/tuning.h"

namespace esvr {

/// The kernel's constants in float32, for inner loops.
[[nodiscard]] ESVR_HD inline KernelConstants<float> narrowed(const KernelConstants<double>& k) {
  return {float(k.shift), float(k.numerator), float(k.plateau),
          float(k.base),  float(k.slope),     float(k.cutoff)};
}

[[nodiscard]] inline SignsAllowed signsOf(const FitTarget& target) {
  return {.positive = target.bothSigns || target.highest > 0.0,
          .negative = target.bothSigns || target.lowest < 0.0};
}

[[nodiscard]] inline EllipsoidLimits limitsOf(const FitTarget& target, const Tuning& tuning) {
  const double range = target.highest - target.lowest;
  const double lowest = target.bothSigns ? -range : target.lowest;
  const double highest = target.bothSigns ? range : target.highest;
  return {tuning.smallestScale, std::min(tuning.largestScale, target.largestScale),
          tuning.intensityHeadroom * lowest, tuning.intensityHeadroom * highest};
}

/// Half width of a seed's window: Tuning::seedWindow times the distance that the ellipsoids would
/// have if they were spread evenly over the active voxels.
[[nodiscard]] inline int seedWindow(const FitTarget& target, std::size_t ellipsoids,
                                    const Tuning& tuning) {
  constexpr int kSmallest = 2, kLargest = 6;  // voxels
  const double distance =
      std::cbrt(double(target.activeVoxels) / double(std::max<std::size_t>(ellipsoids, 1)));
  return std::clamp(int(std::lround(tuning.seedWindow * distance)), kSmallest, kLargest);
}

}  // namespace esvr
