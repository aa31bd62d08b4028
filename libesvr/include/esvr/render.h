#pragma once
/// Draws fields, volumes and several grids together: single pictures, renderers that keep a scene on a device,
/// and pictures that become finer while a user waits.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "esvr/camera.h"
#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/field.h"
#include "esvr/image.h"
#include "esvr/transfer_function.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"

namespace esvr {

// Draws pictures of a field or of a volume. Both follow one rule. The values along the ray of a
// pixel are sampled at the distances 0, step, 2 step, ... from the eye (orthographic: from the
// plane of the eye), as far as the ray lies in the volume. All distances, also those of opacities, are
// lengths in the camera's space (camera.h), and thus of the world. If the eye is more than 2^32 steps
// or voxels away from the volume, samples count from a plane in front of the volume instead; a
// perspective camera from which the volume looks the same by parallel rays, to a quarter of a pixel,
// then has parallel rays. Classification determines how their colors and opacities follow from these
// values; they are composited from front to back. A sample that is exactly the background is empty
// space: it is transparent, whatever the transfer function has there.
//
// The same input and options give a bit-identical picture on any number of threads (those of the
// calling TBB arena).

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
  /// At distances at which a pixel is at least 3 x 2^l of a voxel's longest edges wide, voxels of
  /// 2^l x 2^l x 2^l are drawn, at steps that are 2^l times as long, for l up to 7. Pictures show fewer stray pixels,
  /// take less time, and need less memory. Those of a volume, and of a field with masks, bricks, a narrow band
  /// or values on both sides of the background, are means of the voxels. Those of another field are sums of its ellipsoids, which are widened
  /// as the mean would do (docs/math.md), so that a picture that shows coarser levels only decodes no
  /// voxel. A clip box has at least two voxels and two steps of a level along each axis, or the level is
  /// not used.
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
/// renderVolume(revoxelise(field, voxels)) up to rounding, where coarser levels of detail (LevelOfDetail)
/// do not make it another one.
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

// Renderers draw many pictures of one field or volume, on the CPU or on a CUDA device. They
// prepare their data once and keep them on the device. The pictures are those of renderField() and
// renderVolume(). CPU and CUDA round differently. The tests of tests/render/cuda allow a difference of 1/255 in a channel;
// it may be larger in one channel of 1000 where voxels have a threshold, because rounding decides
// about voxels at the threshold, and in one of 200 of a shaded picture.

/// Time and memory of the last picture.
struct FrameStats {
  double listMs = 0.0;  ///< CUDA: time to project the ellipsoids and list them by tile
  double drawMs = 0.0;  ///< CUDA: time to sum and composite the samples; CPU: whole time
  /// Number of entries of all lists. A tile of pixels has a list for each bin of 32 samples, with
  /// an entry for each ellipsoid that may reach these samples. The number is 0 unless the sum of a
  /// field is drawn with CUDA.
  std::uint64_t listEntries = 0;
  double occupancy = 0.0;  ///< share of the tiles that have a list; for a sum with CUDA
  int depthParts = 1;      ///< parts of a tile's depth that are drawn in parallel
  /// Largest device memory that the renderer has held, including frame buffers; CUDA only.
  std::uint64_t deviceBytes = 0;
};

struct RendererLimits {
  static constexpr int kMaxDepthParts = 16;

  /// Parts of a tile's depth in which a CUDA device draws a sum in parallel, at most kMaxDepthParts. More
  /// parts use the device better if few tiles have most of the work, but in opaque volumes samples
  /// behind the end of a ray are then computed without effect. If the number is 0, the renderer
  /// chooses it by the lists of the first picture.
  int depthParts = 0;
  /// Limit on device memory; 0: no limit. If necessary, pictures are drawn in bands, and bricks of
  /// voxels that were not read for the longest time are dropped.
  std::uint64_t maxBytes = 0;
};

/// A renderer is used from one thread at a time. Renderers can be made and used on several threads at
/// the same time, also for the same field, volume and device; each has data of its own on the device.
/// The field or volume that it draws must outlive it and not change, and so must the bricks and
/// masks of RevoxeliseOptions.
class Renderer {
 public:
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  virtual ~Renderer() = default;

  /// \throws UsageError, Cancelled  as for renderField
  /// \throws DeviceError  the device fails, or maxBytes is too small
  [[nodiscard]] virtual Image draw(const RenderOptions& options) = 0;
  /// Draws without a copy of the picture to the host, for measurements of speed.
  virtual void drawOnDevice(const RenderOptions& options) = 0;
  /// Forgets all voxels that were decoded for earlier pictures, so that the next picture takes as
  /// long as a first one. Pictures do not change.
  virtual void forget() {}
  [[nodiscard]] virtual FrameStats stats() const = 0;
};

/// Makes a renderer that draws as renderField. Voxels are decoded when a ray reads them, on the
/// device that draws, and are kept for later pictures. Pictures have the same bits whatever was
/// decoded before.
/// \throws DeviceError  the device does not exist, the build has no CUDA, or memory is exhausted
/// \throws UsageError   the limits are out of range
[[nodiscard]] std::unique_ptr<Renderer> makeFieldRenderer(const Field& field, const Device& device,
                                                          const RendererLimits& limits = {},
                                                          const RevoxeliseOptions& voxels = {});

/// Makes a renderer that draws as renderVolume. A CUDA renderer makes its own bricks of 8^3 cells,
/// with the 9^3 voxels at the cells' corners (2.9 KB), wherever a voxel is not the background. It
/// makes those of a coarser level of detail when a picture first needs them.
/// \throws DeviceError  as for makeFieldRenderer
/// \throws UsageError   on a CUDA device: the bounding box of the voxels has more than 2^28 blocks
///                      of 64^3 voxels
[[nodiscard]] std::unique_ptr<Renderer> makeVolumeRenderer(const SparseVolume& volume,
                                                           const Device& device,
                                                           const RendererLimits& limits = {});

/// Whether the ellipsoids of a field have so much empty space between them that the table of blocks
/// of voxels, by which rays find bricks, would be too large. makeFieldRenderer() does without this
/// table then: all voxels are decoded when they are first drawn. On a CUDA device, they have no levels
/// of detail, and a shaded picture throws UsageError.
/// \param wanted  the voxels that are drawn
[[nodiscard]] bool liesFarApart(const Field& field, const Box& wanted);

/// A field that is drawn as in makeFieldRenderer with Between::kVoxels.
struct DrawnField {
  const Field* field = nullptr;
  RevoxeliseOptions voxels{};
};
/// A grid that is drawn together with others. What it points to must outlive its renderer.
using DrawnGrid = std::variant<DrawnField, const SparseVolume*>;

/// The largest number of grids that are drawn together.
inline constexpr int kMostGrids = 4;

/// Makes a renderer that draws several grids in one picture, for example a density that absorbs and a
/// temperature that emits. The grids have one index space, and all are sampled at the same places.
/// The first one looks as RenderOptions::transfer says, and the others as RenderOptions::further
/// says, which has a look for each. In a segment between two samples the extinctions of all grids
/// add up, and its color is the mean of the colors of the grids, weighted by their extinctions
/// (docs/math.md).
///
/// The voxels of level 0 are drawn wherever they are, whatever RenderOptions::lod says.
/// Pictures are composited and not shaded.
/// \throws UsageError   there is no grid or there are more than kMostGrids; as for
///                      makeVolumeRenderer
/// \throws DeviceError  as for makeFieldRenderer
/// Renderer::draw() also throws a UsageError if RenderOptions has another mode than kComposite, a
/// shading, or not as many looks as there are grids.
[[nodiscard]] std::unique_ptr<Renderer> makeGridsRenderer(const std::vector<DrawnGrid>& grids,
                                                          const Device& device,
                                                          const RendererLimits& limits = {});

/// Draws a NanoVDB grid by the rule of renderVolume. Other renderers are compared with this one.
/// The position of a sample is computed in float32 as an offset from the point where its ray enters
/// the grid, so that it is precise for a camera at any distance. The exceptions are those of
/// renderField.
[[nodiscard]] Image renderNano(const NanoVolume& volume, const RenderOptions& options);

/// Makes a renderer that draws as renderNano. A CUDA renderer does not need the volume after it was
/// made.
[[nodiscard]] std::unique_ptr<Renderer> makeNanoRenderer(const NanoVolume& volume,
                                                         const Device& device,
                                                         const RendererLimits& limits = {});

// Pictures that are coarse at once and become finer, for programs that show them while a user waits.

/// Draws one picture in passes. The sides of the first pass are an eighth of the picture's, those of
/// the next ones a quarter and a half, and the last pass is the picture itself, with the same bits as
/// Renderer::draw(). A coarse pass is enlarged by bilinear interpolation, so that every pass has the
/// size of the picture and shows the same view. With LevelOfDetail::kAuto, a coarse pass reads
/// coarser levels where its pixels are wide enough.
class ProgressivePicture {
 public:
  /// \param renderer  draws the passes; it must outlive the object and is used from the same thread
  /// \throws UsageError  as for Renderer::draw()
  ProgressivePicture(Renderer& renderer, RenderOptions options);

  /// Draws the next pass, and then further ones as long as they are expected to end within the
  /// budget. A pass is expected to take as long for each pixel as the one before. If it is cancelled
  /// or fails, the picture stays as it was after the last complete pass.
  /// \param seconds  the budget; 0 draws one pass
  /// \return whether the picture is complete
  /// \throws Cancelled, DeviceError  as for Renderer::draw()
  bool refine(double seconds);

  [[nodiscard]] bool complete() const { return side_ == 0; }
  /// The picture after the last pass; nothing before the first one.
  [[nodiscard]] const std::optional<Image>& image() const { return image_; }

 private:
  void drawPass();
  void show();

  Renderer& renderer_;
  RenderOptions options_;
  std::optional<Image> drawn_;  ///< the last pass before it is enlarged
  std::optional<Image> image_;
  int side_ = 8;  ///< pixels of the picture along the side of a pixel of the next pass; 0: complete
};

}  // namespace esvr
