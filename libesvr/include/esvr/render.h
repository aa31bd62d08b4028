#pragma once
/// Draws pictures of a field or of a volume. Both follow one rule. The values along the ray of a
/// pixel are sampled at the distances 0, step, 2 step, ... from the eye (orthographic: from the
/// plane of the eye), as far as the ray lies in the volume. All distances, also those of opacities, are
/// lengths in the camera's space (camera.h), and thus of the world. If the eye is more than 2^32 steps
/// or voxels away from the volume, samples count from a plane in front of the volume instead; a
/// perspective camera from which the volume looks the same by parallel rays, to a quarter of a pixel,
/// then has parallel rays. Classification determines how their colors and opacities follow from these
/// values; they are composited from front to back. A sample that is exactly the background is empty
/// space: it is transparent, whatever the transfer function has there.
///
/// The same input and options give a bit-identical picture on any number of threads (those of the
/// calling TBB arena).

#include <optional>
#include <vector>

#include "esvr/camera.h"
#include "esvr/field.h"
#include "esvr/image.h"
#include "esvr/progress.h"
#include "esvr/sparse_volume.h"
#include "esvr/transfer_function.h"

namespace esvr {

/// The rule that makes a pixel from the samples along its ray.
enum class RenderMode {
  kComposite,  ///< samples are composited from front to back
  kMaximum,    ///< the color and opacity of the largest value
  kAverage,    ///< the color and opacity of the mean value; empty space does not count
  /// Red is the distance from the eye at which half of the light is absorbed (orthographic: from the
  /// plane of the eye), and alpha is 1. Both are 0 if the ray absorbs less than half.
  kDepth
};

/// The rule that gives values colors and opacities.
enum class Classification {
  /// Between two consecutive samples the value changes linearly, and the transfer function is
  /// integrated over the values on the way (docs/math.md). Between two samples in empty space
  /// nothing is drawn. Between empty space and a sample the value begins or ends at the background.
  /// Surfaces are smooth at any step.
  kPreIntegrated,
  /// Each sample stands for a step and has the color and opacity of its value. Where values change
  /// much within a step, stripes appear.
  kPost
};

/// The rule for the values of a field between its voxels.
enum class Between {
  kVoxels,  ///< trilinear interpolation of the voxels of revoxelise(), as in renderVolume
  /// The clamped sum of ellipsoids itself, which a fit constrains at voxels only.
  kSum
};

/// The rule for places where a pixel is wider than several voxels. Sums of ellipsoids (Between::kSum)
/// and NanoVDB grids have no levels of detail.
enum class LevelOfDetail {
  /// At distances at which a pixel is at least 3 x 2^l of a voxel's longest edges wide, means of
  /// 2^l x 2^l x 2^l voxels are drawn, at steps that are 2^l times as long, for l up to 7. Pictures show fewer stray pixels,
  /// take less time, and need less memory. A clip box has at least two voxels and two steps of a
  /// level along each axis, or the level is not used.
  kAuto,
  kOff  ///< voxels are drawn wherever they are
};

/// Shading by the gradient of the values, with one distant light from which both sides of a surface
/// are lit (Blinn and Phong). The color of a sample is multiplied by ambient + diffuse |n . l|, where
/// n is the direction of the gradient and l that to the light, and a highlight of
/// specular |n . h|^shininess is added, where h lies halfway between l and the direction to the eye.
/// Derivatives are differences over half a voxel to each side, at most up to the faces of the brick
/// of 8^3 voxels. A weak gradient is likely to be noise: both terms go over to those of n = l without
/// a highlight, halfway where the gradient is 2 % of the transfer function's range per voxel.
struct Shading {
  /// Direction to the light in the camera's space; by default, the light is above and to the left of the
  /// camera and moves with it.
  std::optional<Vec3> light{};
  double ambient = 0.3, diffuse = 0.7, specular = 0.25, shininess = 25.0;
};

/// How a grid looks that is drawn together with others (makeGridsRenderer).
struct GridLook {
  TransferFunction transfer;
  /// False: the grid emits light, as much as if it absorbed some, but absorbs none. It does not hide
  /// what lies behind it, and adds nothing to alpha.
  bool absorbs = true;
};

struct RenderOptions {
  Camera camera;
  Resolution resolution;
  TransferFunction transfer;        ///< tabulated at 4097 values from its first point to its last
  std::vector<GridLook> further{};  ///< looks of the second grid and of those after it
  double step = 1.0;                ///< distance between samples, in the camera's space
  /// The length, in the camera's space, over which the transfer function's opacities are reached. The opacity
  /// of a step of constant value is 1 - (1 - opacity)^(step / opacityLength).
  double opacityLength = 1.0;
  /// A ray ends when its transmittance falls below this. The default changes a channel by at most
  /// 1/16 of 1/255.
  double minTransmittance = 1.0 / 4096;
  RenderMode mode = RenderMode::kComposite;
  /// Used in RenderMode::kComposite and kDepth; the other modes classify one value for each ray.
  Classification classification = Classification::kPreIntegrated;
  Between between = Between::kVoxels;  ///< used for fields only
  LevelOfDetail lod = LevelOfDetail::kAuto;
  /// Only composited pictures of voxels are shaded: Between::kVoxels and RenderMode::kComposite.
  std::optional<Shading> shading{};
  /// Samples outside this box count as empty space. Its places are those of the index space.
  std::optional<PlaceBox> clip{};
  const CancelToken* cancel = nullptr;  ///< checked before each pixel or tile
};

/// Draws a field. With Between::kSum, no voxels are stored: each ellipsoid adds to the samples of
/// each ray that lie in its support, between the ray's entry and its exit (paper, section
/// "Per-ellipsoid ray sampling", algorithm 2). With Between::kVoxels, the bricks of voxels that
/// rays read are decoded, and no others. The result is the picture of
/// renderVolume(revoxelise(field, voxels)) up to rounding.
/// \param voxels  rule by which sums become voxels. In a narrow band, the voxels inside the surface
///                are -background wherever an ellipsoid reaches. Between::kSum uses its range only
/// \throws UsageError  as for checkCamera and checkTransferFunction; step, opacityLength or
///                     minTransmittance is out of range; the clip box is invalid; a picture that
///                     cannot be shaded has a shading, or its light is invalid; there are looks of
///                     further grids; a ray has more than 2^24 samples; with Between::kVoxels, the box of the bricks has more
///                     than 2^28 blocks of 64^3 voxels
/// \throws MemoryExceeded  with Between::kVoxels, as for reachedBricks
/// \throws Cancelled   RenderOptions::cancel was set
[[nodiscard]] Image renderField(const Field& field, const RenderOptions& options,
                                const RevoxeliseOptions& voxels = {});

/// Draws a volume by marching rays with trilinear interpolation. Empty space between bricks is
/// skipped. The exceptions are those of renderField.
[[nodiscard]] Image renderVolume(const SparseVolume& volume, const RenderOptions& options);

}  // namespace esvr
