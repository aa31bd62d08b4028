#pragma once
/// How far a volume is from its reference. Sums in float64, over the bricks of either volume: empty
/// space counts as voxels where the box says so, but costs nothing.

#include <cstdint>
#include <optional>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr {

struct CompareOptions {
  std::optional<Box>
      box{};  ///< 'PSNR over the box' is taken over it; default: the reference's active bounding box
  std::optional<double> peak{};  ///< default: peakOf(reference)
  bool ssim = false;             ///< 3D SSIM is the one metric that is not nearly free
};

struct VolumeMetrics {
  double peak = 0.0;
  double boxVoxels = 0.0;
  std::uint64_t activeVoxels = 0;  ///< the reference's
  double mseBox = 0.0, mseActive = 0.0;
  double psnrBox = 0.0, psnrActive = 0.0;  ///< dB; +inf where the error is zero
  double maxError = 0.0;                   ///< over the box
  Coord maxErrorAt;
  double p999Error = 0.0;  ///< 99.9th percentile of |error| over the union of active voxels
  double iou = 1.0;        ///< intersection over union of the active voxels
  double massReference = 0.0, massCandidate = 0.0;  ///< sum of (value - background) over the box
  std::optional<double> ssim;
};

/// Voxels outside the box count for nothing but `iou`, `psnrActive` and `p999Error`.
/// p999Error is the nearest-rank percentile: the smallest error that 99.9 % do not exceed. The same
/// bits for any number of threads.
/// \throws BadInput  the reference has no active voxel; a value is not finite (names the voxel)
/// \throws UsageError  the box is empty, the given peak not positive
[[nodiscard]] VolumeMetrics compareVolumes(const SparseVolume& reference,
                                           const SparseVolume& candidate,
                                           const CompareOptions& options = {});

/// The peak of PSNR: the largest value over the active voxels; where that is not positive, the
/// largest magnitude of a value; 1 where all are zero. \throws BadInput  no active voxel
[[nodiscard]] double peakOf(const SparseVolume& reference);

/// 10 log10(peak^2 / mse); +inf for mse = 0.
[[nodiscard]] double psnr(double mse, double peak);

/// 3D SSIM over the box: Gaussian window of 11^3, sigma 1.5, C1 = (0.01 L)^2, C2 = (0.03 L)^2, L =
/// peak (Wang et al. 2004, the paper's window); windows clipped at the box's border and
/// renormalised. Windows that see background only are not visited: they count as 1 where both
/// backgrounds are equal, else as the formula has it.
/// \throws UsageError  as compareVolumes; BadInput: a value in the box is not finite
[[nodiscard]] double ssim3d(const SparseVolume& reference, const SparseVolume& candidate,
                            const Box& box, double peak);

}  // namespace esvr
