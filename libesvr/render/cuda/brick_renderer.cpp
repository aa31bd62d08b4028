// The renderer that marches rays through bricks of cells on a CUDA device.

#include <algorithm>
#include <cmath>

#include "core/cuda/use_device.h"
#include "render/brick_atlas.h"
#include "render/cuda/brick_draw.h"
#include "render/cuda/make_cuda_renderer.h"
#include "render/cuda/march_renderer.h"
#include "render/scene_depth.h"

namespace esvr::cuda {
namespace {

std::size_t marchTilesAlong(int pixels) {
  return std::size_t((pixels + kMarchTileSide - 1) / kMarchTileSide);
}

class BrickRenderer final : public MarchRenderer {
 public:
  BrickRenderer(const BrickAtlas& atlas, float background, const Device& device,
                const RendererLimits& limits)
      : MarchRenderer(device, limits),
        background_(background),
        origin_{double(atlas.origin.x), double(atlas.origin.y), double(atlas.origin.z)},
        blocks_(atlas.blocks),
        box_(cellsOf(atlas)),
        multiprocessors_(multiprocessorsOf(device)),
        blockOf_(atlas.blockOf, stream()),
        brickOf_(atlas.brickOf, stream()),
        bricks_(atlas.bricks, stream()),
        values_(atlas.values, stream()) {}

 private:
  static_assert(kBandRows % kMarchTileSide == 0);

  void launch(const RenderOptions& o, Band band, float4* pixels) override {
    if (bricks_.size() == 0) return;
    View view(o.camera, o.resolution);
    view.eye = difference(view.eye, origin_);
    ClipBox clip = clipOf(o);
    clip.box = {difference(clip.box.low, origin_), difference(clip.box.high, origin_)};
    const std::size_t tileRows = marchTilesAlong(band.rows);
    makeRoom(ranges_, tileRows * marchTilesAlong(o.resolution.width), stream());
    launchBricks({.atlas = {{0, 0, 0}, blocks_, blockOf_.data(), brickOf_.data(), values_.data()},
                  .bricks = bricks_.data(),
                  .count = std::uint32_t(bricks_.size()),
                  .scene = {view, box_, o.step, clip, sampleRule(o, table().view(), background_)},
                  .resolution = o.resolution,
                  .firstTileRow = band.firstRow / kMarchTileSide,
                  .tileRows = int(tileRows),
                  .ranges = ranges_.data(),
                  .firstSample = double(binsWithin(box_, view, o.step).first) * kBinSamples,
                  .pixels = pixels},
                 multiprocessors_, stream());
  }
  std::size_t contentBytes() const override {
    return blockOf_.bytes() + brickOf_.bytes() + bricks_.bytes() + values_.bytes() +
           ranges_.bytes();
  }
  std::size_t bytesOfRow(Resolution r) const override {
    return marchTilesAlong(r.width) * sizeof(int2) / kMarchTileSide + 1;
  }

  float background_;
  Vec3 origin_;
  Coord blocks_;
  PlaceBox box_;  ///< box of the cells, relative to the atlas
  int multiprocessors_;
  DeviceBuffer<std::uint32_t> blockOf_, brickOf_;
  DeviceBuffer<Coord> bricks_;
  DeviceBuffer<float> values_;
  DeviceBuffer<int2> ranges_;
};

}  // namespace

std::unique_ptr<Renderer> makeCudaVolumeRenderer(const SparseVolume& volume, const Device& device,
                                                 const RendererLimits& limits) {
  return std::make_unique<BrickRenderer>(makeBrickAtlas(volume), volume.background, device, limits);
}

}  // namespace esvr::cuda
