#pragma once
/// Estimates how the PSNR of a fit grows with its number of ellipsoids.

#include <algorithm>
#include <cmath>

#include "convert/attempt.h"

namespace esvr::convert {

/// The PSNR, dB, of a fit with a number of ellipsoids.
struct CountPoint {
  double count, psnr;
};

/// Smallest factor between two numbers of ellipsoids whose fits give a slope: closer ones differ by
/// the noise of fits, a few tenths of a dB.
inline constexpr double kMinSlopeRatio = 1.15;

/// Limits of a slope, so that noise does not lead a search astray. Short fits gained 4.8 dB
/// (smoke1), 5.1 dB (dragon) and 6.7 dB (aneurism).
inline constexpr double kMinDbPerDoubling = kDbPerDoubling / 2.0;
inline constexpr double kMaxDbPerDoubling = kDbPerDoubling * 3.0;

/// The gain of PSNR by twice the ellipsoids, dB, between two fits of the same length, within the
/// limits. \return kDbPerDoubling if the numbers are too close to each other
[[nodiscard]] inline double dbPerDoubling(const CountPoint& a, const CountPoint& b) {
  const double doublings = std::log2(b.count / a.count);
  if (std::abs(doublings) < std::log2(kMinSlopeRatio)) return kDbPerDoubling;
  return std::clamp((b.psnr - a.psnr) / doublings, kMinDbPerDoubling, kMaxDbPerDoubling);
}

/// The number of ellipsoids that reaches a PSNR if it grows from a fit's with this slope.
[[nodiscard]] inline double countFor(const CountPoint& from, double psnr, double slope) {
  return from.count * std::exp2((psnr - from.psnr) / slope);
}

}  // namespace esvr::convert
