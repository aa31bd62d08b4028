#pragma once
/// The results of `esvr-compare stability`.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/frame_range.h"
#include "esvr/stability.h"

namespace esvr::compare {

/// The measurement of a grid on one device.
struct DeviceStability {
  std::string device;
  Stability stability;
  bool passes = false;  ///< within --max-difference
};

struct GridStability {
  std::string name{};  ///< with the frame, in a sequence
  std::optional<cli::FrameNumber> frame{};
  std::string whyNone{};  ///< why there is nothing to measure; empty if there is
  std::size_t ellipsoids = 0;
  double peak = 0.0;       ///< peak of the source (peakOf)
  bool corrected = false;  ///< whether a residual is added to the sum, which is not measured
  std::vector<DeviceStability> devices{};  ///< the CPU, and a GPU if it was measured
  /// Largest difference of the two devices, value units; nothing if one was measured.
  std::optional<double> betweenDevices{};
};

struct StabilityRecord {
  std::vector<GridStability> grids;
  std::vector<std::string> failures;  ///< a line for each grid and device that differs too much
};

/// A difference as a share of the peak of a grid; 0 if there is no difference.
[[nodiscard]] inline double shareOfPeak(const GridStability& grid, double difference) {
  return difference == 0.0 ? 0.0 : difference / grid.peak;
}

}  // namespace esvr::compare
