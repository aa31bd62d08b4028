#pragma once
/// Pictures of a field or of a volume, by one rule. Along the ray of a pixel, values are sampled at
/// the distances 0, step, 2 step, ... from the eye (orthographic: from the plane of the eye). A
/// sample's value, and nothing else, says its color and opacity (post-classification); samples are
/// put over each other from front to back. A sample that is exactly the background is empty space:
/// transparent, whatever the transfer function has there.
///
/// The same input and options give the same bits on any number of threads (the calling TBB
/// arena's).

#include <optional>

#include "esvr/camera.h"
#include "esvr/field.h"
#include "esvr/image.h"
#include "esvr/progress.h"
#include "esvr/sparse_volume.h"
#include "esvr/transfer_function.h"

namespace esvr {

/// The way in which the samples along a ray become a pixel.
enum class RenderMode {
  kComposite,  ///< put over each other from front to back
  kMaximum,    ///< the largest value, with its color and its opacity as it is
  kAverage,    ///< the mean value, likewise; empty space does not count
  /// Red: how far away half of the light is stopped, in voxels (orthographic: from the plane of the
  /// eye). Alpha: 1, or 0 where more comes through, and red is 0 too.
  kDepth
};

/// The values of a field between its voxels.
enum class Between {
  kVoxels,  ///< interpolated trilinearly from the voxels that revoxelise() has: as renderVolume
  kSum      ///< the sum of ellipsoids itself, which a fit that looks at voxels leaves open there
};

/// A box of places. Voxel (i, j, k) reaches half a voxel to each side of (i, j, k).
struct PlaceBox {
  Vec3 low, high;
};

struct RenderOptions {
  Camera camera;
  Resolution resolution;
  TransferFunction transfer;  ///< taken at 4097 places from its first point to its last
  double step = 1.0;          ///< voxels between samples
  /// Voxels that an opacity of the transfer function holds for: a sample's is 1 - (1 - opacity) ^
  /// (step / opacityLength).
  double opacityLength = 1.0;
  /// A ray ends where less than this part of the light behind would come through. At the default
  /// that costs a 16th of a level of 255.
  double minTransmittance = 1.0 / 4096;
  RenderMode mode = RenderMode::kComposite;
  Between between = Between::kVoxels;   ///< the values of a field between its voxels
  std::optional<PlaceBox> clip{};       ///< samples outside of it count as empty space
  const CancelToken* cancel = nullptr;  ///< looked at before each row of tiles
};

/// Draws the sum of ellipsoids without keeping voxels of it (paper, section "Per-ellipsoid ray
/// sampling", algorithm 2), by tiles of pixels and bins of samples. Between::kSum: each ellipsoid
/// adds to those samples of each ray that lie in its support, found by solving for entry and exit.
/// Between::kVoxels: each adds to those voxels of its support that a tile's samples in a bin lie
/// between; the samples are interpolated from these. That is the picture of
/// renderVolume(revoxelise(field, voxels)), but for rounding.
/// \param voxels  how sums become voxels; its bricks are not looked at. Of a narrow band, voxels
///                inside are -background wherever an ellipsoid reaches
/// \throws UsageError  as checkCamera and checkTransferFunction; step, opacityLength or
///                     minTransmittance out of range; a clip box that is no box; rays of more than
/// 2^24 samples
///                     through the supports; Cancelled
[[nodiscard]] Image renderField(const Field& field, const RenderOptions& options,
                                const RevoxeliseOptions& voxels = {});

/// Marches rays through voxels with trilinear interpolation and jumps over bricks that are not
/// there. \throws  as renderField
[[nodiscard]] Image renderVolume(const SparseVolume& volume, const RenderOptions& options);

}  // namespace esvr
