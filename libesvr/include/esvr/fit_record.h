#pragma once
/// What a fit says of itself: stored in the file, printed in reports, drawn by the benchmarks.

#include <cstdint>
#include <vector>

namespace esvr {

/// Error against run time: one point of a fit's curve.
struct CurvePoint {
  double seconds = 0.0;  ///< since the fit began
  std::uint32_t iteration = 0;
  std::uint64_t primitives = 0;
  double psnrBox = 0.0;     ///< dB over the box, peak = the reference's maximum
  double psnrActive = 0.0;  ///< dB over the active voxels
  double maxError = 0.0;    ///< largest absolute error, in value units
  friend bool operator==(const CurvePoint&, const CurvePoint&) = default;
};

}  // namespace esvr
