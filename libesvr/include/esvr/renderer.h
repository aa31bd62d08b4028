#pragma once
/// Renderers draw many pictures of one field or volume, on the CPU or on a CUDA device. They
/// prepare their data once and keep them on the device. The pictures are those of render.h. CPU and
/// CUDA round differently. The tests of tests/render/cuda allow a difference of 1/255 in a channel;
/// it may be larger in one channel of 1000 where voxels have a threshold, because rounding decides
/// about voxels at the threshold, and in one of 200 of a shaded picture.

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "esvr/device.h"
#include "esvr/nano_volume.h"
#include "esvr/render.h"

namespace esvr {

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

}  // namespace esvr
