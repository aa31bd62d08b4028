#pragma once
/// The curve of a fit: its error after a number of iterations. Files store it without times;
/// FitResult and reports also have the times.

#include <cstdint>
#include <vector>

namespace esvr {

/// The state of a fit after an iteration. It depends on the input, the options, the seed and the
/// device only, so that a file that stores it is reproducible.
struct CurvePoint {
  std::uint32_t iteration = 0;
  std::uint64_t ellipsoids = 0;
  double psnrBox = 0.0;     ///< dB over the box; the peak is the source's (peakOf)
  double psnrActive = 0.0;  ///< dB over the active voxels
  double maxError = 0.0;    ///< largest absolute error, in value units
  friend bool operator==(const CurvePoint&, const CurvePoint&) = default;
};

/// A curve point with the time at which it was reached.
struct TimedCurvePoint : CurvePoint {
  double seconds = 0.0;  ///< wall-clock time since the fit began
};

/// The points as a file stores them: without their times, and with PSNRs that are rounded to float.
[[nodiscard]] inline std::vector<CurvePoint> withoutTimes(
    const std::vector<TimedCurvePoint>& curve) {
  std::vector<CurvePoint> points(curve.begin(), curve.end());
  for (CurvePoint& point : points) {
    point.psnrBox = float(point.psnrBox);
    point.psnrActive = float(point.psnrActive);
  }
  return points;
}

}  // namespace esvr
