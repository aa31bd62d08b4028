#pragma once
/// Fits a volume with step sizes around those of fit(), and beyond.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "stability_cases.h"

namespace esvr::bench {

/// A fit whose step sizes are a multiple of the tuned ones.
struct FitRun {
  double factor = 1.0;
  double psnr = 0.0;          ///< dB over the box at the end
  double largestError = 0.0;  ///< as a share of the peak
  std::uint32_t iterations = 0;
  std::size_t ellipsoids = 0;
  bool finite = true;     ///< whether all parameters and errors are finite
  std::string failure{};  ///< why the fit ended early; empty if it did not
  std::vector<TimedCurvePoint> curve{};
};

struct FitFigures {
  std::uint64_t activeVoxels = 0;
  double psnrOfNothing = 0.0;          ///< dB, without an ellipsoid
  std::optional<FitRun> inOneChunk{};  ///< of a case in chunks: the same fit in one chunk
  std::vector<FitRun> runs;            ///< by increasing factors
};

/// The factors by which step sizes are multiplied: around 1, and beyond for the margin.
inline constexpr double kFactors[] = {0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0};

/// \param iterations  length of the schedule
[[nodiscard]] FitFigures measureFits(const FitCase& fitCase, const Device& device,
                                     std::uint32_t iterations);

}  // namespace esvr::bench
