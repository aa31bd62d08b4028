// The renderer that marches rays through several grids on a CUDA device.

#include <algorithm>
#include <memory>
#include <optional>

#include "render/cuda/cell_store.h"
#include "render/cuda/grids_draw.h"
#include "render/cuda/make_cuda_renderer.h"
#include "render/cuda/march_renderer.h"
#include "render/grids_scene.h"
#include "render/picture.h"

namespace esvr::cuda {
namespace {

using Stores = std::vector<std::unique_ptr<CellStore>>;

std::unique_ptr<CellStore> storeOfGrid(const DrawnGrid& grid, cudaStream_t stream) {
  if (const auto* const drawn = std::get_if<DrawnField>(&grid))
    return storeOf(*drawn->field, drawn->voxels, stream);
  return storeOf(*std::get<const SparseVolume*>(grid), stream);
}

Stores storesOf(const std::vector<DrawnGrid>& grids, cudaStream_t stream) {
  Stores stores;
  for (const DrawnGrid& grid : grids) stores.push_back(storeOfGrid(grid, stream));
  return stores;
}

/// The caches of all grids that have one.
class GridCaches {
 public:
  explicit GridCaches(const Stores& stores) {
    for (const auto& store : stores) caches_.push_back(store->cache());
  }

  /// \return null if no brick can be missing
  [[nodiscard]] BrickCache* any() const {
    const auto first =
        std::ranges::find_if(caches_, [](const BrickCache* c) { return c != nullptr; });
    return first == caches_.end() ? nullptr : *first;
  }
  void forget() const {
    forEach([](BrickCache& cache, std::size_t) { cache.forget(); });
  }
  /// Sets what rays write to ask for bricks. \param pass  see BrickCache::demand()
  void demand(int pass, GridsDrawArguments& arguments) const {
    int ahead = 1 << 30;
    forEach([&](BrickCache& cache, std::size_t g) {
      arguments.demand[g] = cache.demand(pass);
      ahead = std::min(ahead, arguments.demand[g].ahead);
      if (&cache == any()) arguments.waitingCount = &arguments.demand[g].counts->waiting;
    });
    arguments.ahead = ahead;
  }
  /// Decodes bricks that rays have asked for. \return number of tiles whose rays wait
  [[nodiscard]] std::uint32_t serve(GridsDrawArguments& arguments) const {
    constexpr LevelBounds kLevel0{};
    std::uint32_t waiting = 0;
    forEach([&](BrickCache& cache, std::size_t g) {
      const BrickDemand::Counts counts = cache.counts();
      if (&cache == any()) waiting = counts.waiting;
      cache.serve(counts, kLevel0);
      arguments.slots[g] = cache.slots();
    });
    return waiting;
  }
  /// The largest number of tiles that may go on. All bricks for which their rays wait must have room
  /// at the same time. Otherwise, rays that have a brick of one grid and wait for one of another
  /// could take turns for ever.
  [[nodiscard]] std::uint32_t mostTiles() const {
    std::uint32_t most = 0xffffffffu;
    forEach([&](const BrickCache& cache, std::size_t) {
      if (cache.isCrowded()) most = std::min(most, cache.slotCount() / kMarchTilePixels);
    });
    return most;
  }
  /// Divides memory among the caches in proportion to their bricks.
  void limit(std::uint64_t bytes, const Stores& stores) const {
    double bricks = 0.0;
    forEach([&](const BrickCache&, std::size_t g) { bricks += stores[g]->level(0).count(); });
    forEach([&](BrickCache& cache, std::size_t g) {
      cache.limit(std::max<std::uint64_t>(
          1, std::uint64_t(double(bytes) * stores[g]->level(0).count() / std::max(bricks, 1.0))));
    });
  }

 private:
  static_assert(BrickSlotsView::kPageSlots >= kMarchTilePixels,
                "a page has room for a tile's rays");

  template <class Visit>
  void forEach(Visit&& visit) const {
    for (std::size_t g = 0; g < caches_.size(); ++g)
      if (caches_[g] != nullptr) visit(*caches_[g], g);
  }

  std::vector<BrickCache*> caches_;  ///< null: all bricks of the grid are there
};

class GridsRenderer final : public MarchRenderer {
 public:
  GridsRenderer(const std::vector<DrawnGrid>& grids, const Device& device,
                const RendererLimits& limits)
      : MarchRenderer(device, limits),
        stores_(storesOf(grids, stream())),
        caches_(stores_),
        waiting_(stream()) {}

  void forget() override { caches_.forget(); }

 private:
  std::size_t gridCount() const override { return stores_.size(); }

  void prepare(const RenderOptions& o) override {
    checkGridsOptions(o, stores_.size());
    scene_.reset();
    if (std::ranges::all_of(stores_, [](const auto& s) { return s->level(0).count() == 0; }))
      return;
    std::vector<GridTable> tables;
    for (std::size_t g = 0; g < stores_.size(); ++g)
      tables.push_back({stores_[g]->level(0).table(), stores_[g]->level(0).box(),
                        table(g, lookOf(o, g).transfer, samplingOf(o)), stores_[g]->background()});
    scene_ = gridsScene(o, tables);
  }

  void launch(const RenderOptions& o, Band band, float4* pixels) override {
    if (!scene_) return;
    const TileBand tiles = bandOf(o, band, pixels);
    launchClearRanges(tiles, stream());
    for (std::size_t g = 0; g < stores_.size(); ++g)
      launchWidenRanges(tiles, coveringBricks(g, o.resolution), stream());
    GridsDrawArguments arguments{.scene = *scene_,
                                 .grids = int(stores_.size()),
                                 .slots = {},
                                 .band = tiles,
                                 .demand = {},
                                 .ahead = 0,
                                 .waitingCount = nullptr,
                                 .waiting = nullptr};
    for (std::size_t g = 0; g < stores_.size(); ++g) arguments.slots[g] = stores_[g]->slots();
    drawAndServe(o, arguments);
  }

  TileBand bandOf(const RenderOptions& o, Band band, float4* pixels) {
    const int tileRows = TileBand::tilesAlong(band.rows);
    makeRoom(ranges_, std::size_t(tileRows) * std::size_t(TileBand::tilesAlong(o.resolution.width)),
             stream());
    return {.resolution = o.resolution,
            .firstTileRow = band.firstRow / kMarchTileSide,
            .tileRows = tileRows,
            .ranges = ranges_.data(),
            .firstSample = firstSampleOf(*scene_),
            .pixels = pixels};
  }

  /// Bricks that are known to be vacant do not count.
  CoveringBricks coveringBricks(std::size_t grid, Resolution resolution) const {
    const DeviceLevel& bricks = stores_[grid]->level(0);
    const CoverView cover = coverViewOf(*scene_, grid, resolution);
    return {cover.view,     cover.step,     bricks.bricks(),
            bricks.first(), bricks.count(), stores_[grid]->slots().slotOf};
  }

  /// Draws, decodes the bricks that rays ask for and lets the rays continue, until none waits.
  void drawAndServe(const RenderOptions& o, GridsDrawArguments& arguments) {
    arguments.waiting = waiting_.found(std::size_t(arguments.band.tiles()));
    caches_.demand(0, arguments);
    launchMarch(arguments, {}, stream());
    std::uint32_t count = caches_.serve(arguments), kept = 0;
    WaitingTiles<KeptGridsRay> tiles;
    for (int pass = 1; count + kept > 0; ++pass) {
      checkCancelled(o);
      tiles = pass == 1 ? waiting_.begin(count, false)
                        : waiting_.next(tiles, kept, count, caches_.mostTiles());
      kept += count - tiles.count;
      caches_.demand(pass, arguments);
      launchMarch(arguments, tiles, stream());
      count = caches_.serve(arguments);
    }
  }

  bool decodesBricks() const override { return caches_.any() != nullptr; }
  void shareMemory(std::uint64_t left) override { caches_.limit(left, stores_); }
  std::size_t fixedBytes() const override {
    std::size_t bytes = ranges_.bytes();
    for (const auto& store : stores_) {
      bytes += store->bytes();
      if (const BrickCache* const cache = store->cache())
        bytes += cache->fixedBytes() - cache->bytes();
    }
    return bytes;
  }
  std::size_t contentBytes() const override {
    std::size_t bytes = ranges_.bytes() + waiting_.bytes();
    for (const auto& store : stores_) bytes += store->bytes();
    return bytes;
  }
  std::size_t bytesOfRow(Resolution r) const override {
    return bytesOfTileRow<KeptGridsRay>(r, caches_.any() != nullptr, false) / kMarchTileSide + 1;
  }

  Stores stores_;
  GridCaches caches_;
  std::optional<GridsScene> scene_;  ///< of the picture that is drawn; nothing without cells
  WaitingMemory<KeptGridsRay> waiting_;
  DeviceBuffer<int2> ranges_;
};

}  // namespace

std::unique_ptr<Renderer> makeCudaGridsRenderer(const std::vector<DrawnGrid>& grids,
                                                const Device& device,
                                                const RendererLimits& limits) {
  return std::make_unique<GridsRenderer>(grids, device, limits);
}

}  // namespace esvr::cuda
