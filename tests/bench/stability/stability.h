#pragma once
/// The stiff and extreme cases of docs/figures/stability.md, and what is measured of them: gradients against differences
/// in float64, and fits with step sizes around those of fit(), and beyond.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/volume.h"
#include "fit/gradient_scene.h"

namespace esvr::bench {

/// A fit of a volume.
struct FitCase {
  std::function<SparseVolume()> volume;
  std::size_t count = 0;           ///< ellipsoids
  std::optional<float> kappa{};    ///< of the kernel; nothing: it is fitted
  std::function<Field()> start{};  ///< ellipsoids to begin with; empty: seeds
  std::uint64_t chunkVoxels = 0;   ///< active voxels of a chunk; 0: one chunk
};

struct StabilityCase {
  std::string name;                               ///< of the row
  std::string detail;                             ///< what is measured, as sentences
  std::function<Field()> field{};                 ///< is evaluated; empty: not measured
  std::optional<test::GradientCase> gradients{};  ///< nothing: not measured
  std::optional<FitCase> fit{};                   ///< nothing: not measured
  /// Further ellipsoids at the same voxels, in the measurement of gradients.
  std::size_t crowd = 0;
};

[[nodiscard]] std::vector<StabilityCase> stabilityCases();

// Gradients.

struct GradientErrors {
  /// Largest error of a derivative, divided by the sum of the magnitudes of the terms of the largest
  /// derivative of its ellipsoid.
  double largest = 0.0;
  double bound = 0.0;         ///< the largest that the arithmetic allows
  double shareOfBound = 0.0;  ///< largest error divided by its own bound
};

/// Measures the gradients of four ellipsoids.
/// \param crowd  ellipsoids of the same shapes that are added to the sum, as faint as they are many
[[nodiscard]] GradientErrors measureGradients(const test::GradientCase& gradientCase,
                                              std::size_t crowd, const Device& device);

// Fits.

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
