#pragma once
/// Errors of a volume against a reference. Sums are formed in float64 over the bricks of either
/// volume. Empty space within the box counts as voxels but takes no computing time. Where only one
/// volume has a brick, the other one has its background or, inside the surface of a narrow band, the
/// negated background.

#include <cstdint>
#include <optional>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr {

struct CompareOptions {
  std::optional<Box> box{};      ///< box of the PSNR; default: the reference's active bounding box
  std::optional<double> peak{};  ///< peak of the PSNR; default: peakOf(reference)
  bool ssim = false;             ///< whether 3D SSIM is computed, which takes most of the time
};

struct VolumeMetrics {
  double peak = 0.0;
  double boxVoxels = 0.0;
  std::uint64_t activeVoxels = 0;  ///< active voxels of the reference
  double mseBox = 0.0, mseActive = 0.0;
  double psnrBox = 0.0, psnrActive = 0.0;  ///< dB; +inf if the error is zero
  double maxError = 0.0;                   ///< largest absolute error over the box
  Coord maxErrorAt;
  double p999Error = 0.0;  ///< 99.9th percentile of |error| over the union of active voxels
  double iou = 1.0;        ///< intersection over union of the active voxels
  double massReference = 0.0, massCandidate = 0.0;  ///< sum of (value - background) over the box
  std::optional<double> ssim;
};

/// Compares two volumes. Voxels outside the box affect `iou`, `psnrActive` and `p999Error` only.
/// p999Error is the nearest-rank percentile: the smallest error that 99.9 % of the voxels do not
/// exceed. The result is bit-identical for any number of threads.
/// \throws BadInput  the reference has no active voxel; a value is not finite (the text names the
///                   voxel)
/// \throws UsageError  the box is empty, or the given peak is not positive
[[nodiscard]] VolumeMetrics compareVolumes(const SparseVolume& reference,
                                           const SparseVolume& candidate,
                                           const CompareOptions& options = {});

/// VolumeMetrics::psnrBox alone, which takes less time.
/// \throws BadInput, UsageError  as for compareVolumes
[[nodiscard]] double psnrOverBox(const SparseVolume& reference, const SparseVolume& candidate,
                                 const CompareOptions& options = {});

/// The peak of the PSNR of a volume: peakOf() of its active values and its background
/// (sparse_volume.h). All programs, searches and reports use it.
/// \throws BadInput  there is no active voxel
[[nodiscard]] double peakOf(const SparseVolume& reference);

/// The range to which a bound on errors such as 1 % refers: the largest active value minus the
/// smallest one, without the background, and 0 if all are equal. The bound of a vector refers to
/// valueRangeOfVectors() (vector_metrics.h).
/// \throws BadInput  there is no active voxel
[[nodiscard]] double valueRangeOf(const SparseVolume& reference);

/// 10 log10(peak^2 / mse) in dB; +inf for mse = 0.
[[nodiscard]] double psnr(double mse, double peak);

/// 3D SSIM over the box, with a Gaussian window of 11^3 voxels, sigma 1.5, C1 = (0.01 L)^2,
/// C2 = (0.03 L)^2 and L = peak (Wang et al. 2004, the paper's window). Windows are clipped at the
/// border of the box and renormalised. The SSIM of windows that cover background only is computed
/// once for all of them; it is 1 if both backgrounds are equal.
/// \throws UsageError  as for compareVolumes
/// \throws BadInput    a value in the box is not finite
[[nodiscard]] double ssim3d(const SparseVolume& reference, const SparseVolume& candidate,
                            const Box& box, double peak);

}  // namespace esvr
