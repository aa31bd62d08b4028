#pragma once
/// Errors of a volume, of a level set, of vectors and of the frames of a sequence against a reference.

#include <array>
#include <cstdint>
#include <optional>

#include "esvr/ellipsoids.h"
#include "esvr/grid.h"
#include "esvr/tone.h"
#include "esvr/volume.h"

namespace esvr {

// The transmittance of a volume that is looked through, such as smoke. A picture of it shows how much
// light passes, and not its values: half of the values may be a hundredth of the largest one, and
// they are most of what is seen.
//
// The values along each axis of index space are added up within a box, where values below 0 and
// values outside the box count as 0. This gives three pictures of optical depth, with a pixel for
// each column of voxels. A column of depth d lets exp(-k d) of the light through. k is such that the
// median column of the reference lets T of it through; the median is the upper one of the columns of
// all three pictures that are deeper than a thousandth of the largest value. The squared errors of the
// transmittance are averaged over all columns of the box, empty ones too, and the peak is 1. Three T
// stand for three densities in a renderer.

/// Whether a grid is shown by looking through it: it is a fog volume, or it has no class and no
/// active value below 0, and space outside its bricks is empty, which means a background of at most 0.
[[nodiscard]] bool isLookedThrough(GridClass gridClass, const SparseVolume& volume);

/// PSNR of transmittance, in dB; +inf if the errors are zero.
struct TransmittancePsnr {
  double medianDepth = 0.0;  ///< sum of the values of the reference's median column
  double psnr90 = 0.0, psnr50 = 0.0, psnr10 = 0.0;  ///< for T = 0.9, 0.5 and 0.1
};

/// The PSNR of the candidate's transmittance. Voxels of the candidate outside the box do not count.
/// The result is bit-identical for any number of threads and for volumes that are shifted by whole
/// bricks.
/// \param box  default: the reference's active bounding box
/// \return nothing if no column of the reference has a positive depth, or if its background is
///         above 0, so that no light passes
/// \throws BadInput  a value is not finite (the text names the voxel)
[[nodiscard]] std::optional<TransmittancePsnr> transmittancePsnr(
    const SparseVolume& reference, const SparseVolume& candidate,
    const std::optional<Box>& box = {});

/// TransmittancePsnr::medianDepth of a volume.
/// \param box  default: the active bounding box
/// \return, \throws  as for transmittancePsnr
[[nodiscard]] std::optional<double> medianDepth(const SparseVolume& volume,
                                                const std::optional<Box>& box = {});

/// Estimates medianDepth() of the voxels of a field, for which some of its columns are evaluated, at
/// most as many for each axis as lie in 2048 bricks. Voxels count whether they would be active or not.
/// \param box    the active bounding box
/// \param range  of the active values; the value of the sum is clamped to it and to the background
/// \param tone   the sum is a tone of this curve
/// \return  as for transmittancePsnr
[[nodiscard]] std::optional<double> medianDepth(const Field& field, const Box& box,
                                                const ValueRange& range, ToneCurve tone = {});

// Errors of a volume against a reference. Sums are formed in float64 over the bricks of either
// volume. Empty space within the box counts as voxels but takes no computing time. Where only one
// volume has a brick, the other one has its background or, inside the surface of a narrow band, the
// negated background.

struct CompareOptions {
  std::optional<Box> box{};      ///< box of the PSNR; default: the reference's active bounding box
  std::optional<double> peak{};  ///< peak of the PSNR; default: peakOf(reference)
  bool ssim = false;             ///< whether 3D SSIM is computed, which takes most of the time
  bool transmittance = false;    ///< whether the PSNR of the transmittance is computed
  /// What the volumes have lost of doubles. The errors are those of the doubles, or up to so much larger, but for the
  /// PSNR of the transmittance and SSIM.
  Narrowing narrowing{};
};

struct VolumeMetrics {
  double peak = 0.0;
  double boxVoxels = 0.0;
  std::uint64_t activeVoxels = 0;  ///< active voxels of the reference that are finite
  std::uint64_t nonFinite = 0;     ///< voxels of both volumes that are equal and not finite
  double mseBox = 0.0, mseActive = 0.0;
  double psnrBox = 0.0, psnrActive = 0.0;  ///< dB; +inf if the error is zero
  double maxError = 0.0;                   ///< largest absolute error over the box
  Coord maxErrorAt;
  double p999Error = 0.0;  ///< 99.9th percentile of |error| over the union of active voxels
  double iou = 1.0;        ///< intersection over union of the active voxels
  double massReference = 0.0, massCandidate = 0.0;  ///< sum of (value - background) over the box
  std::optional<double> ssim;
  std::optional<TransmittancePsnr> transmittance;  ///< of a reference that lets light through
};

/// Compares two volumes. Where both have NaN, or the same infinity, at an active voxel, the voxel counts in no figure, and
/// where all voxels of the box do, the errors are 0. Voxels outside the box affect `iou`, `psnrActive` and `p999Error` only.
/// p999Error is the nearest-rank percentile: the smallest error that 99.9 % of the voxels do not
/// exceed. The result is bit-identical for any number of threads.
/// \throws BadInput  the reference has no active voxel; a value of one volume is NaN or infinite, and that of the other
///                   one is something else (the text names the voxel and both)
/// \throws UsageError  the box is empty, or the given peak is not positive
[[nodiscard]] VolumeMetrics compareVolumes(const SparseVolume& reference,
                                           const SparseVolume& candidate,
                                           const CompareOptions& options = {});

/// VolumeMetrics::psnrBox alone, which takes less time.
/// \throws BadInput, UsageError  as for compareVolumes
[[nodiscard]] double psnrOverBox(const SparseVolume& reference, const SparseVolume& candidate,
                                 const CompareOptions& options = {});

/// The peak of the PSNR of a volume: peakOf() of its active values and its background
/// (volume.h). All programs, searches and reports use it.
/// \throws BadInput  there is no active voxel
[[nodiscard]] double peakOf(const SparseVolume& reference);

/// The range to which a bound on errors such as 1 % refers: the largest active value minus the
/// smallest one, without the background, and 0 if all are equal. The bound of a vector refers to
/// valueRangeOfVectors().
/// \throws BadInput  there is no active voxel
[[nodiscard]] double valueRangeOf(const SparseVolume& reference);

// The error relative to each value.

struct RelativeError {
  double share = 0.0;  ///< |error| / max(|value|, floor); infinite if it is not a number
  Coord at;            ///< the first voxel that has it; the origin if there is no error
};

/// The largest relative error of a voxel in the bricks of either volume.
/// \param floor  above 0; nothing: leastMagnitude() of the reference
[[nodiscard]] RelativeError largestRelativeError(const SparseVolume& reference,
                                                 const SparseVolume& candidate,
                                                 std::optional<double> floor);

/// The smallest magnitude above 0 of the active values, but not below 2^-126 (1.2e-38) if one of them is not: smaller
/// floats have fewer digits, and many programs take them for 0. Infinity if all are 0.
[[nodiscard]] double leastMagnitude(const SparseVolume& volume);

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

// Counts the voxels of a level set whose sign is not that of a reference.

struct SignErrors {
  std::uint64_t voxels = 0;      ///< voxels with another sign than in the reference
  std::optional<Coord> first{};  ///< index coordinates of one of them
};

/// Compares the signs of all voxels in the bricks of either volume, active or not. A voxel is
/// negative (inside) or not; 0 is outside. Where a volume has no brick, the sign is that of
/// EmptySigns (volume.h). Elsewhere, neither volume has a brick; if no voxel is counted and the
/// signs around the empty space of both volumes agree, the signs are the same there, too.
[[nodiscard]] SignErrors compareSigns(const SparseVolume& reference, const SparseVolume& candidate);

// Errors of a grid of vectors against a reference.

/// All PSNR of a grid of vectors have the same peak: by default that of its vectors, peakOfVectors.
/// A component that is small everywhere therefore has a high PSNR if its error is small against the
/// longest vector.
struct VectorMetrics {
  VolumeMetrics magnitude;  ///< of the lengths of the vectors
  std::array<VolumeMetrics, kComponents> components;
};

/// The length of the longest active vector, or 1 if all are zero. It does not depend on the
/// direction of the axes.
/// \throws BadInput  there is no active voxel
[[nodiscard]] double peakOfVectors(const VectorVolume& reference);

/// The range to which a bound on the errors of all components refers, such as 1 %: the largest
/// valueRangeOf() of a component. A component that hardly changes is thus not stored more precisely
/// than the others.
/// \throws BadInput  there is no active voxel
[[nodiscard]] double valueRangeOfVectors(const VectorVolume& reference);

/// Compares vectors by compareVolumes. A voxel of a grid of vectors is active if it is active in
/// any component.
/// \param options  the default of the peak is peakOfVectors(reference)
/// \throws BadInput, UsageError  as for compareVolumes
[[nodiscard]] VectorMetrics compareVectors(const VectorVolume& reference,
                                           const VectorVolume& candidate,
                                           const CompareOptions& options = {},
                                           const VectorNarrowing& narrowing = {});

// The error of the change of a grid from one frame of a sequence to the next. Errors that differ
// from frame to frame are seen as flicker, even if each frame is close to its reference.

/// The volumes of a grid in two consecutive frames, which must outlive the object.
struct FramePair {
  const SparseVolume& before;
  const SparseVolume& after;
};

/// The temporal difference of a grid: `after` minus `before` for each voxel, rounded to float32. A
/// voxel is active if it is active in either. Where only one volume has a brick, the other one has
/// its background or, inside the surface of a narrow band, the negated background.
[[nodiscard]] SparseVolume temporalDifference(const FramePair& frames);

/// The PSNR of the candidate's temporal difference against that of the reference, in dB; +inf if
/// they are equal. The result does not depend on the number of threads.
/// \param options  The default of the box encloses the active voxels of the reference in both
///                 frames. The default of the peak is the larger one of its peaks (peakOf) in the
///                 two frames, so that the value compares to the PSNR of a frame.
/// \throws BadInput  the reference has no active voxel in both frames; a value is not finite
/// \throws UsageError  as for compareVolumes
[[nodiscard]] double temporalPsnr(const FramePair& reference, const FramePair& candidate,
                                  const CompareOptions& options = {});

}  // namespace esvr
