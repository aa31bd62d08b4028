// The renderer that marches rays through bricks of cells on a CUDA device.

#include <functional>
#include <optional>

#include "render/cuda/brick_draw.h"
#include "render/cuda/cell_store.h"
#include "render/cuda/make_cuda_renderer.h"
#include "render/cuda/march_renderer.h"
#include "render/picture.h"
#include "render/scene_depth.h"

namespace esvr::cuda {
namespace {

/// Makes the bricks on the renderer's stream.
using MakeStore = std::function<std::unique_ptr<CellStore>(cudaStream_t)>;

class CellRenderer final : public MarchRenderer {
 public:
  CellRenderer(const MakeStore& makeStore, const Device& device, const RendererLimits& limits)
      : MarchRenderer(device, limits), store_(makeStore(stream())), waiting_(stream()) {}

  void forget() override {
    if (store_->cache() != nullptr) store_->cache()->forget();
  }

 private:
  static_assert(kBandRows % kMarchTileSide == 0);

  void prepare(const RenderOptions& o) override {
    const View view = viewOf(o, store_->box());
    scene_ = {marchScene(o, view, sampleRule(o, {}, store_->background())),
              levelBounds(o, view, store_->box()),
              {}};
    store_->prepare(scene_->bounds);
    for (int l = scene_->bounds.first; l <= scene_->bounds.last; ++l)
      scene_->levels[l - scene_->bounds.first] = {
          store_->level(l).table(), store_->level(l).box(),
          table(std::size_t(l - scene_->bounds.first), o.transfer,
                samplingOf(o, LevelFrame{l}.side()))};
  }

  void launch(const RenderOptions& o, Band band, float4* pixels) override {
    if (store_->level(0).count() == 0) return;
    const TileBand tiles = bandOf(o, band, pixels);
    BrickDrawArguments arguments{*scene_, store_->slots(), tiles, {}, nullptr};
    launchClearRanges(tiles, stream());
    launchWidenRanges(tiles, coveringBricks(o), stream());
    if (store_->cache() == nullptr)
      launchMarch(arguments, {}, stream());
    else
      drawAndServe(o, arguments, *store_->cache());
  }

  TileBand bandOf(const RenderOptions& o, Band band, float4* pixels) {
    const int tileRows = TileBand::tilesAlong(band.rows);
    makeRoom(ranges_, std::size_t(tileRows) * std::size_t(TileBand::tilesAlong(o.resolution.width)),
             stream());
    const PlaceBox box = store_->level(scene_->bounds.last).box();
    return {.resolution = o.resolution,
            .firstTileRow = band.firstRow / kMarchTileSide,
            .tileRows = tileRows,
            .ranges = ranges_.data(),
            .firstSample = double(binsWithin(box, coarsestView(), o.step).first) * kBinSamples,
            .pixels = pixels};
  }

  /// The bricks of the coarsest level, which are the fewest. Those that are known to be vacant do not
  /// count. If there are several levels, they do: means may be the background where voxels are not.
  CoveringBricks coveringBricks(const RenderOptions& o) const {
    const DeviceLevel& coarsest = store_->level(scene_->bounds.last);
    return {coarsestView(),    o.step,
            coarsest.bricks(), coarsest.first(),
            coarsest.count(),  scene_->bounds.oneLevel() ? store_->slots().slotOf : nullptr};
  }

  View coarsestView() const { return scene_->at(scene_->last()).view; }

  /// Draws, decodes the bricks that rays ask for and lets the rays continue, until none waits.
  void drawAndServe(const RenderOptions& o, BrickDrawArguments arguments, BrickCache& cache) {
    arguments.waiting = waiting_.found(std::size_t(arguments.band.tiles()));
    arguments.demand = cache.demand(0);
    launchMarch(arguments, {}, stream());
    auto counts = cache.counts();
    WaitingTiles<KeptRay> tiles;
    for (int pass = 1; counts.waiting > 0; ++pass) {
      checkCancelled(o);
      tiles = pass == 1 ? waiting_.begin(counts.waiting, arguments.scene.scene.isShaded)
                        : waiting_.next(tiles, 0, counts.waiting, counts.waiting);
      cache.serve(counts, arguments.scene.bounds);
      arguments.slots = cache.slots();
      arguments.demand = cache.demand(pass);
      launchMarch(arguments, tiles, stream());
      counts = cache.counts();
    }
  }

  bool decodesBricks() const override { return store_->cache() != nullptr; }
  void shareMemory(std::uint64_t left) override {
    if (store_->cache() != nullptr) store_->cache()->limit(left);
  }
  std::size_t fixedBytes() const override {
    const BrickCache* const cache = store_->cache();
    const std::size_t content = store_->bytes() + ranges_.bytes();
    return cache == nullptr ? content : content - cache->bytes() + cache->fixedBytes();
  }
  std::size_t contentBytes() const override {
    return store_->bytes() + ranges_.bytes() + waiting_.bytes();
  }
  std::size_t bytesOfRow(Resolution r) const override {
    return bytesOfTileRow<KeptRay>(r, store_->cache() != nullptr, scene_->scene.isShaded) /
               kMarchTileSide +
           1;
  }

  std::unique_ptr<CellStore> store_;
  std::optional<LevelScene> scene_;  ///< of the picture that is drawn
  WaitingMemory<KeptRay> waiting_;
  DeviceBuffer<int2> ranges_;
};

}  // namespace

std::unique_ptr<Renderer> makeCudaCellRenderer(const Field& field, const Device& device,
                                               const RendererLimits& limits,
                                               const RevoxeliseOptions& voxels) {
  const auto store = [&](cudaStream_t stream) { return storeOf(field, voxels, stream); };
  return std::make_unique<CellRenderer>(store, device, limits);
}

std::unique_ptr<Renderer> makeCudaVolumeRenderer(const SparseVolume& volume, const Device& device,
                                                 const RendererLimits& limits) {
  const auto store = [&](cudaStream_t stream) { return storeOf(volume, stream); };
  return std::make_unique<CellRenderer>(store, device, limits);
}

}  // namespace esvr::cuda
