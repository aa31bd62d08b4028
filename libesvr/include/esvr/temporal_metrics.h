#pragma once
/// The error of the change of a grid from one frame of a sequence to the next. Errors that differ
/// from frame to frame are seen as flicker, even if each frame is close to its reference.

#include "esvr/metrics.h"
#include "esvr/sparse_volume.h"

namespace esvr {

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
