#pragma once
/// The curve of a fit: how its error fell as it went on. Files hold it without times, reports and
/// FitResult with them.

#include <cstdint>
#include <vector>

namespace esvr {

/// The state of a fit after some of its iterations. It depends on the input, the options, the seed
/// and the device only, so a file may hold it.
struct CurvePoint {
  std::uint32_t iteration = 0;
  std::uint64_t ellipsoids = 0;
  double psnrBox = 0.0;     ///< dB over the box, peak = the reference's maximum
  double psnrActive = 0.0;  ///< dB over the active voxels
  double maxError = 0.0;    ///< largest absolute error, in value units
  friend bool operator==(const CurvePoint&, const CurvePoint&) = default;
};

/// The same with the wall-clock time at which it was reached: error against run time.
struct TimedCurvePoint : CurvePoint {
  double seconds = 0.0;  ///< since the fit began
};

/// The points without their times, as a file holds them.
[[nodiscard]] inline std::vector<CurvePoint> withoutTimes(
    const std::vector<TimedCurvePoint>& curve) {
  return {curve.begin(), curve.end()};
}

}  // namespace esvr
