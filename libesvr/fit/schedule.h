#pragma once
/// The schedule of growth, relocation and step sizes, as functions of the fraction of a run.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "fit/tuning.h"

namespace esvr {

/// A run that grows from `from` to `to` ellipsoids and has a length of `iterations`.
struct Schedule {
  std::size_t from = 0, to = 0;
  std::uint32_t iterations = 0;
  const Tuning& tuning;

  /// The number of ellipsoids, which grows linearly until Tuning::growUntil.
  [[nodiscard]] std::size_t countAt(double fraction) const {
    const double share = std::min(1.0, fraction / tuning.growUntil);
    return from + std::size_t(std::llround(share * double(to - from)));
  }
  /// The factor of the step sizes. It rises in the warm-up, decays exponentially, and goes to zero
  /// at the end, so that the steps leave no noise.
  [[nodiscard]] double stepAt(double fraction, std::uint32_t iteration) const {
    const double warm = std::min(1.0, double(iteration + 1) / tuning.warmUp);
    const double tail = std::min(1.0, (1.0 - fraction) / tuning.tail);
    return warm * tail * std::pow(tuning.finalStep, fraction);
  }
  [[nodiscard]] std::uint32_t eventInterval() const {
    const auto share = std::uint32_t(tuning.eventEvery * iterations);
    return std::max(share, std::uint32_t(tuning.eventSpacing));
  }
  [[nodiscard]] std::size_t relocationsAt(double fraction, std::size_t ellipsoids) const {
    if (fraction >= tuning.relocateUntil) return 0;
    return std::size_t(tuning.relocateShare * double(ellipsoids));
  }
};

}  // namespace esvr
