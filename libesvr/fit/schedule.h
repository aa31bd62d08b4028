#pragma once
/// When a run adds, moves and steps, as functions of the fraction of the run that is done.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "fit/tuning.h"

namespace esvr {

/// A run: from `from` to `to` ellipsoids over `iterations`.
struct Schedule {
  std::size_t from = 0, to = 0;
  std::uint32_t iterations = 0;
  const Tuning& tuning;

  /// Ellipsoids wanted at a fraction of the run: linear from `from` to `to` until growUntil.
  [[nodiscard]] std::size_t countAt(double fraction) const {
    const double share = std::min(1.0, fraction / tuning.growUntil);
    return from + std::size_t(std::llround(share * double(to - from)));
  }
  /// Factor of the step sizes: exponential decay after a warm-up, and to nothing at the very end,
  /// where steps of a fixed size would leave their own noise.
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
