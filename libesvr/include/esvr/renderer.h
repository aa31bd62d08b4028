#pragma once
/// Renderers that draw many pictures of one thing, on the CPU or on a CUDA device: what is prepared
/// once stays where it is needed. The pictures are those of render.h; the two devices' are within
/// 1/255 of each other a channel.

#include <cstdint>
#include <memory>

#include "esvr/device.h"
#include "esvr/nano_volume.h"
#include "esvr/render.h"

namespace esvr {

/// The cost of the last picture.
struct FrameStats {
  double listMs = 0.0;  ///< CUDA: ellipsoids looked at and listed by tiles
  double drawMs = 0.0;  ///< CUDA: samples summed and composited. CPU: all
  /// Ellipsoids in lists: one entry for each tile of pixels and 32 samples of depth that it may
  /// reach. Of a field on CUDA; else 0.
  std::uint64_t pairs = 0;
  double occupancy = 0.0;  ///< share of the tiles that have a list; of a field on CUDA
  int depthParts = 1;      ///< parts of a tile's depth that were drawn at once
  /// Most that the renderer held on its device so far, frame buffers included; CUDA only.
  std::uint64_t deviceBytes = 0;
};

struct RendererLimits {
  /// Parts of the depth of a tile that a CUDA device draws at once: more keep it busy where few
  /// tiles have most of the work, and stop later where little shines through. 0: by the lists of
  /// the first picture. At most 16.
  int depthParts = 0;
  /// Bound on the memory on the device; pictures are drawn in bands to keep it. 0: no bound.
  std::uint64_t maxBytes = 0;
};

/// Used from one thread. What it was made of must outlive it.
class Renderer {
 public:
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  virtual ~Renderer() = default;

  /// \throws UsageError, Cancelled  as renderField; DeviceError: the device fails, or maxBytes are
  ///                                too few
  [[nodiscard]] virtual Image draw(const RenderOptions& options) = 0;
  /// The same work without bringing the picture to the host: to be measured.
  virtual void drawOnDevice(const RenderOptions& options) = 0;
  [[nodiscard]] virtual FrameStats stats() const = 0;
};

/// Draws as renderField. \throws DeviceError  no such device, a build without CUDA, out of memory;
///                                             UsageError: limits out of range
[[nodiscard]] std::unique_ptr<Renderer> makeFieldRenderer(const Field& field, const Device& device,
                                                          const RendererLimits& limits = {},
                                                          const RevoxeliseOptions& voxels = {});

/// Draws as renderVolume. On a CUDA device from bricks of 8^3 cells with the 9^3 voxels at their
/// corners, 2.9 KB each, where any is not the background; it does not need the volume any more.
/// \throws DeviceError  as makeFieldRenderer; UsageError: on a CUDA device, voxels so far apart
/// that
///                      there are more than 2^28 blocks of 64^3 between them
[[nodiscard]] std::unique_ptr<Renderer> makeVolumeRenderer(const SparseVolume& volume,
                                                           const Device& device,
                                                           const RendererLimits& limits = {});

/// The picture of renderVolume, marched through a NanoVDB grid: the reference that others are
/// compared with. Places are float32 relative to where a ray enters. \throws  as
/// renderField
[[nodiscard]] Image renderNano(const NanoVolume& volume, const RenderOptions& options);

/// Draws as renderNano. Does not need the volume any more once it is made on a CUDA device.
[[nodiscard]] std::unique_ptr<Renderer> makeNanoRenderer(const NanoVolume& volume,
                                                         const Device& device,
                                                         const RendererLimits& limits = {});

}  // namespace esvr
