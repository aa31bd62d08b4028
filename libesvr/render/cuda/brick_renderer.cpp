// The renderer that marches rays through bricks of cells on a CUDA device.

#include <algorithm>
#include <cmath>

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

/// Addresses of the pages into which contiguous slots are divided.
std::vector<const float*> pagesOf(const DeviceBuffer<float>& values) {
  std::vector<const float*> pages;
  for (std::size_t first = 0; first < values.size(); first += BrickSlotsView::kPageFloats)
    pages.push_back(values.data() + first);
  return pages;
}

class BrickRenderer final : public MarchRenderer {
 public:
  BrickRenderer(const BrickAtlas& atlas, float background, const Device& device,
                const RendererLimits& limits)
      : MarchRenderer(device, limits),
        background_(background),
        origin_{double(atlas.table.origin.x), double(atlas.table.origin.y),
                double(atlas.table.origin.z)},
        blocks_(atlas.table.blocks),
        box_(cellsOf(atlas.table)),
        blockOf_(atlas.table.blockOf, stream()),
        brickOf_(atlas.table.brickOf, stream()),
        bricks_(atlas.table.bricks, stream()),
        values_(atlas.values, stream()),
        pages_(pagesOf(values_), stream()) {}

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
    const BrickDrawArguments arguments{
        .table = {{0, 0, 0}, blocks_, blockOf_.data(), brickOf_.data()},
        .slots = {nullptr, pages_.data()},
        .bricks = bricks_.data(),
        .count = std::uint32_t(bricks_.size()),
        .scene = {view, box_, o.step, clip, sampleRule(o, table().view(), background_)},
        .resolution = o.resolution,
        .firstTileRow = band.firstRow / kMarchTileSide,
        .tileRows = int(tileRows),
        .ranges = ranges_.data(),
        .firstSample = double(binsWithin(box_, view, o.step).first) * kBinSamples,
        .pixels = pixels,
        .demand = {},
        .waiting = nullptr};
    launchRanges(arguments, stream());
    launchMarch(arguments, {}, stream());
  }
  std::size_t contentBytes() const override {
    return blockOf_.bytes() + brickOf_.bytes() + bricks_.bytes() + values_.bytes() +
           pages_.bytes() + ranges_.bytes();
  }
  std::size_t bytesOfRow(Resolution r) const override {
    return marchTilesAlong(r.width) * sizeof(int2) / kMarchTileSide + 1;
  }

  float background_;
  Vec3 origin_;
  Coord blocks_;
  PlaceBox box_;  ///< box of the cells, relative to the atlas
  DeviceBuffer<std::uint32_t> blockOf_, brickOf_;
  DeviceBuffer<Coord> bricks_;
  DeviceBuffer<float> values_;
  DeviceBuffer<const float*> pages_;  ///< see BrickSlotsView
  DeviceBuffer<int2> ranges_;
};

}  // namespace

std::unique_ptr<Renderer> makeCudaVolumeRenderer(const SparseVolume& volume, const Device& device,
                                                 const RendererLimits& limits) {
  return std::make_unique<BrickRenderer>(makeBrickAtlas(volume), volume.background, device, limits);
}

}  // namespace esvr::cuda
