#pragma once
/// Attempts of the searches for a size and for a PSNR: a fit, and its stored grid.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "convert/sample.h"
#include "esvr/compact.h"
#include "esvr/convert.h"

namespace esvr::convert {

/// What bounds the time that voxels take where they are an alternative to ellipsoids.
struct VoxelLimits {
  /// Largest number of voxels in bricks for which voxels are coded without need. One core codes and
  /// decodes 3 to 15 million of them per second.
  std::size_t maxVoxels = std::size_t{1} << 25;
  /// The sample from which the bytes of the exact voxels of a larger volume are estimated.
  SampleSize sample{.bricks = 2048, .runs = 128};
};

/// The input and the options of a search. A job does not own them.
struct Job {
  const ConvertInput& input;
  const ConvertOptions& options;
  VoxelLimits limits{};
};

/// True if the conversion was cancelled. What it has so far is then completed in the shortest way.
[[nodiscard]] bool isCancelled(const Job& job);

/// Makes the stored grid of a fit, and takes its field. If the conversion is cancelled, active voxels
/// are found by value, since masks and the thresholds of blocks take long to choose, and the end of the
/// fit becomes kCancelled.
[[nodiscard]] StoredGrid storedGridOf(const Job& job, FitResult& fit);

/// bytesAdded() of a grid of ellipsoids. Unlike that of voxels it takes little time, so that nothing
/// cancels it.
[[nodiscard]] std::uint64_t bytesOfEllipsoids(const StoredGrid& grid);

/// PSNR of a volume or of a decoded grid over the box, dB.
[[nodiscard]] double psnrOf(const Job& job, const SparseVolume& volume);
[[nodiscard]] double psnrOf(const Job& job, const StoredGrid& grid);

/// How a stored grid of the job finds its active voxels.
[[nodiscard]] ActivityOptions activityOf(const Job& job);

/// How voxels store the active mask of a grid: as StorageOptions say, but exactly for a level set,
/// because the width of its band is part of its shape.
[[nodiscard]] Activity voxelActivity(const Job& job);

/// How active voxels are stored in a grid of a size: as StorageOptions say, but without a mask for
/// Activity::kAuto if a simplified one would take more than a quarter of the size, because too little
/// would be left for the values.
[[nodiscard]] Activity activityForSize(const Job& job, std::uint64_t bytes);

/// True if the thresholds of a grid's blocks take more than a quarter of a size, as for a mask.
[[nodiscard]] bool levelsTakeTooMuch(const StoredGrid& grid, std::uint64_t bytes);

/// How voxels are rounded: with their signs if the grid is a narrow band.
[[nodiscard]] RoundedSigns voxelSigns(const Job& job);

/// Whether a reader of the grid gets halfs, as for a source that was saved as half.
[[nodiscard]] DecodedValues decodedValues(const Job& job);

/// The target of a search.
struct PsnrTarget {
  double psnr = 0.0;  ///< dB over the box
  /// Bytes of a grid below which nothing further is tried, because it could save little.
  std::uint64_t smallEnough = 512;
  /// Share of the bytes of voxels that ellipsoids must be expected to stay below to be fitted.
  double worthwhileShare = 1.0;
};

/// Options of a short fit: a quarter of the iterations, and at most 100.
[[nodiscard]] FitOptions shortened(FitOptions options);

enum class FitLength { kShort, kWhole };

struct Attempt {
  FitResult fit;          ///< its field was moved to the grid
  StoredGrid grid;        ///< grid in float32
  double psnr = 0.0;      ///< dB over the box
  std::size_t asked = 0;  ///< wanted number of ellipsoids; the grid may have fewer
  Decision bothSigns;     ///< the decision of withBetterSigns()

  [[nodiscard]] std::size_t count() const { return grid.field.ellipsoidCount(); }
  [[nodiscard]] bool cancelled() const { return fit.end == FitEnd::kCancelled; }
};

/// Fits about `count` ellipsoids: at least one, and at most the number of active voxels.
[[nodiscard]] Attempt attempt(const Job& job, double count, FitLength length);

/// Whether a fit of a number of ellipsoids may continue an attempt: that has at most 1.18 times and at
/// least two thirds of them. Where more are dropped, a fit from seeds is better (dragon, 0.6 times as
/// many: 49.4 dB, and 47.3 dB continued).
[[nodiscard]] bool canContinue(const Attempt& from, double count);

/// Share of the expected number of ellipsoids that a short fit has, so that a fit can continue it.
inline constexpr double kContinuedFrom = 0.9;

/// Adds ellipsoids to those of an earlier attempt, short or whole, or drops the weakest, and fits all of
/// them by 0.4 times the iterations of a whole fit (docs/lab-notes.md, "Continued fits").
/// \param count  at least the number of the earlier attempt's ellipsoids
[[nodiscard]] Attempt continued(const Job& job, const Attempt& from, double count);

/// True if many active voxels have an extreme value of the volume, so that both signs of
/// intensities may be better.
[[nodiscard]] bool saturates(const SparseVolume& volume);

/// PSNR of a full fit less that of a short fit of as many ellipsoids, dB.
[[nodiscard]] double shortFitBehind(const SparseVolume& volume);

/// Decides whether intensities have both signs (FitOptions::bothSigns in `options`), unless this is
/// already set: where many voxels have an extreme value and the volume is no narrow band, a second
/// short fit with both signs is compared.
/// \param own  a short fit of about the wanted number of ellipsoids, with the signs of the values
/// \return the better of the short fits
[[nodiscard]] Attempt withBetterSigns(const ConvertInput& input, Attempt own,
                                      ConvertOptions& options);

/// Loss of PSNR by quantising, dB, at which further bytes gain as much in more ellipsoids as in
/// more bits (docs/lab-notes.md, "More ellipsoids or more bits").
inline constexpr double kUsualLoss = 0.9;

// Usual values, with which a short fit is extrapolated. They decide which full fits are made; the
// PSNR and the bytes of every stored grid are measured.
/// Bytes that an ellipsoid takes in a grid that lost kUsualLoss by quantising.
inline constexpr double kBytesPerEllipsoid = 7.5;
/// Bytes that an ellipsoid takes at least.
inline constexpr double kMinBytesPerEllipsoid = 4.5;
/// Bytes per ellipsoid of a short fit, relative to those of a full fit.
inline constexpr double kShortFitPrice = 0.94;
/// PSNR, dB, by which a full fit is given the chance to exceed its extrapolation.
inline constexpr double kUncertainty = 1.0;

/// The goal of storing an attempt: `loss`, unless a PSNR or a number of bytes is given.
struct StorageTarget {
  double loss = kUsualLoss;
  std::optional<double> psnr{};          ///< dB over the box
  std::optional<std::uint64_t> bytes{};  ///< bytes of the ellipsoids' sections
};
/// The device on which rate control passes over the whole volume: that of the fit, or the CPU if the
/// fit was divided into chunks, because the volume may not fit into the memory of the GPU.
[[nodiscard]] Device rateControlDevice(const FitResult& fit, const Device& device);

/// Compacts a grid: quickly (CompactOptions::quick) if the fit was cancelled, or if the conversion is
/// cancelled meanwhile.
[[nodiscard]] CompactResult compacted(const Job& job, const StoredGrid& grid, const FitResult& fit,
                                      const StorageTarget& target);
[[nodiscard]] CompactResult compacted(const Job& job, const Attempt& attempt,
                                      const StorageTarget& target);

/// The PSNR of a conversion over the box, dB: measured, or, if that is cancelled, what the fit and rate
/// control have measured.
[[nodiscard]] double psnrOf(const Job& job, const Conversion& conversion);

/// Bytes per ellipsoid, at least 1.
[[nodiscard]] double priceOf(const Attempt& attempt, const CompactResult& compact);

/// Makes a conversion from a fit and its compact grid.
[[nodiscard]] Conversion conversionOf(FitResult fit, CompactResult compact);

/// Makes a conversion from a fit and its grid in float32.
[[nodiscard]] Conversion conversionOf(Attempt attempt);

}  // namespace esvr::convert
