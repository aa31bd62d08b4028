#pragma once
/// Draws a field on a CUDA device, by per-ellipsoid ray sampling (paper, algorithm 2).

#include <optional>
#include <vector>

#include "core/cuda/device_buffer.h"
#include "core/cuda/event.h"
#include "core/cuda/stream.h"
#include "esvr/renderer.h"
#include "render/cuda/device_table.h"
#include "render/cuda/tile_frame.h"
#include "render/scene_depth.h"

namespace esvr::cuda {

/// Device memory of a field, which is kept from picture to picture.
struct SceneMemory {
  SceneMemory(const Field& field, cudaStream_t stream);

  DeviceBuffer<PackedEllipsoid> ellipsoids;
  DeviceBuffer<Vec3> origins;
  DeviceBuffer<RayKernel> kernels;
  DeviceBuffer<EllipsoidView> views;
  DeviceBuffer<Footprint> footprints;
  DeviceBuffer<std::uint32_t> large;

  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] DeviceEllipsoids view() const;
  [[nodiscard]] SeenEllipsoids seen();
};

/// Device memory of a band of the picture. It grows when a band needs more.
struct BandMemory {
  DeviceBuffer<FrameCounters> counters;
  DeviceBuffer<std::uint32_t> counts, ends, entries, sorted;
  DeviceBuffer<TilePart> items;
  DeviceBuffer<std::uint32_t> partsOfTile, partsDone, closedAt, resultOf;
  DeviceBuffer<RayState> results;
  DeviceBuffer<float4> pixels;

  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] TileLists lists();
};

class FieldRenderer final : public Renderer {
 public:
  FieldRenderer(const Field& field, const Device& device, const RendererLimits& limits,
                const RevoxeliseOptions& voxels);

  Image draw(const RenderOptions& options) override;
  void drawOnDevice(const RenderOptions& options) override;
  FrameStats stats() const override { return stats_; }

 private:
  /// A band of the picture, in rows of tiles.
  struct Band {
    int first, count;
  };
  struct Scene;  ///< shared by all bands of a picture

  void drawFrame(const RenderOptions& options, Image* image);
  [[nodiscard]] std::size_t fixedBytes() const { return scene_.bytes() + table_.bytes(); }
  void drawBand(const Scene& scene, Band band, Image* image);
  [[nodiscard]] TileFrame frameOf(const Scene& scene, Band band) const;
  [[nodiscard]] std::size_t bandBytes(const TileFrame& frame) const;
  void reserve(const TileFrame& frame);
  void list(const TileFrame& frame);
  [[nodiscard]] int chosenParts(const TileFrame& frame);
  [[nodiscard]] FrameCounters drawOnce(const Scene& scene, const TileFrame& frame);
  void grow(const FrameCounters& counters);
  [[nodiscard]] FrameCounters readCounters();
  void download(const TileFrame& frame, Image& image);
  void count(const TileFrame& frame, const FrameCounters& counters);

  const Field& field_;
  RendererLimits limits_;
  VoxelRule voxelRule_;
  std::optional<PlaceBox> box_;
  Stream stream_;
  int multiprocessors_;
  SceneMemory scene_;
  BandMemory band_;
  Event begin_, listed_, drawn_;
  DeviceTable table_;
  int parts_;  ///< parts of the depth; 0: not yet chosen
  std::uint64_t tiles_ = 0, occupied_ = 0;
  FrameStats stats_;
};

}  // namespace esvr::cuda
