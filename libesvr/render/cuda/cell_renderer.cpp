// The renderer that marches rays through bricks of cells on a CUDA device.

#include <functional>
#include <optional>

#include "render/cuda/cell_store.h"
#include "render/cuda/make_cuda_renderer.h"
#include "render/cuda/march_renderer.h"
#include "render/picture.h"
#include "render/scene_depth.h"

namespace esvr::cuda {
namespace {

/// The tiles whose rays wait for bricks, in memory that grows with their number.
class Waiting {
 public:
  explicit Waiting(cudaStream_t stream)
      : stream_(stream), found_(stream), entries_(stream), tiles_(stream) {}

  /// Memory for the numbers of waiting tiles or entries.
  std::uint32_t* found(std::size_t tiles) { return found_.reserve(tiles); }

  /// Takes the tiles that were found after the first pass; their rays begin anew.
  WaitingTiles begin(std::uint32_t count) {
    copy(tiles_.reserve(count), count);
    makeRoom(rays_, std::size_t(count) * kMarchTilePixels, stream_);
    return view(count, true);
  }
  /// Takes the entries that were found in a later pass.
  WaitingTiles next(std::uint32_t count) {
    copy(entries_.reserve(count), count);
    return view(count, false);
  }
  [[nodiscard]] std::size_t bytes() const {
    return found_.bytes() + entries_.bytes() + tiles_.bytes() + rays_.bytes();
  }

 private:
  void copy(std::uint32_t* to, std::uint32_t count) {
    check(
        cudaMemcpyAsync(to, found_.data(), count * sizeof(*to), cudaMemcpyDeviceToDevice, stream_),
        "listing waiting rays");
  }
  WaitingTiles view(std::uint32_t count, bool begin) {
    return {count, begin, entries_.data(), tiles_.data(), rays_.data()};
  }

  cudaStream_t stream_;
  GrowingBuffer<std::uint32_t> found_, entries_, tiles_;
  DeviceBuffer<RayProgress> rays_;
};

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
    const View view(o.camera, o.resolution);
    scene_ = {marchScene(o, sampleRule(o, {}, store_->background())),
              levelBounds(o, view, store_->box()),
              {}};
    store_->prepare(scene_->bounds);
    for (int l = scene_->bounds.first; l <= scene_->bounds.last; ++l)
      scene_->levels[l - scene_->bounds.first] = {store_->level(l).table(), store_->level(l).box(),
                                                  tableOf(o, l)};
  }

  void launch(const RenderOptions& o, Band band, float4* pixels) override {
    if (store_->level(0).count() == 0) return;
    BrickDrawArguments arguments = argumentsOf(o, band, pixels);
    if (store_->cache() == nullptr) {
      launchRanges(arguments, stream());
      launchMarch(arguments, {}, stream());
    } else {
      drawAndServe(o, arguments, *store_->cache());
    }
  }

  BrickDrawArguments argumentsOf(const RenderOptions& o, Band band, float4* pixels) {
    const int last = scene_->bounds.last;
    const DeviceLevel& coarsest = store_->level(last);
    const View view = scene_->at(scene_->last()).view;
    const int tileRows = tilesAlong(band.rows);
    makeRoom(ranges_, std::size_t(tileRows) * std::size_t(tilesAlong(o.resolution.width)),
             stream());
    return {.scene = *scene_,
            .slots = store_->slots(),
            .bricks = coarsest.bricks(),
            .firstBrick = coarsest.first(),
            .count = coarsest.count(),
            .resolution = o.resolution,
            .firstTileRow = band.firstRow / kMarchTileSide,
            .tileRows = tileRows,
            .ranges = ranges_.data(),
            .firstSample = double(binsWithin(coarsest.box(), view, o.step).first) * kBinSamples,
            .pixels = pixels,
            .demand = {},
            .waiting = nullptr};
  }

  /// Draws, decodes the bricks that rays ask for and lets the rays continue, until none waits.
  void drawAndServe(const RenderOptions& o, BrickDrawArguments arguments, BrickCache& cache) {
    arguments.waiting = waiting_.found(ranges_.size());
    arguments.demand = cache.demand(0);
    launchRanges(arguments, stream());
    launchMarch(arguments, {}, stream());
    auto counts = cache.counts();
    for (int pass = 1; counts.waiting > 0; ++pass) {
      checkCancelled(o);
      const WaitingTiles tiles =
          pass == 1 ? waiting_.begin(counts.waiting) : waiting_.next(counts.waiting);
      cache.serve(counts, arguments.scene.bounds);
      arguments.slots = cache.slots();
      arguments.demand = cache.demand(pass);
      launchMarch(arguments, tiles, stream());
      counts = cache.counts();
    }
  }

  static int tilesAlong(int pixels) { return (pixels + kMarchTileSide - 1) / kMarchTileSide; }

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
    const bool waits = store_->cache() != nullptr;
    const std::size_t ofTile =
        sizeof(int2) +
        (waits ? kMarchTilePixels * sizeof(RayProgress) + 3 * sizeof(std::uint32_t) : 0);
    return std::size_t(tilesAlong(r.width)) * ofTile / kMarchTileSide + 1;
  }

  std::unique_ptr<CellStore> store_;
  std::optional<LevelScene> scene_;  ///< of the picture that is drawn
  Waiting waiting_;
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
