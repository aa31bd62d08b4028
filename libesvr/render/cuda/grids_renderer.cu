// Draws the bricks of several grids in one picture. Rays wait for missing bricks as in
// cell_renderer.cu.
#include <algorithm>
#include <memory>
#include <optional>

#include "core/cuda/runtime.h"
#include "render/cuda/cuda_renderers.h"
#include "render/cuda/march_renderer.cuh"
#include "render/grids_march.h"
#include "render/picture.h"

namespace esvr::cuda {
namespace {

struct GridsDrawArguments {
  GridsScene scene;  ///< tables are on the device
  int grids;         ///< 1 to kMostGrids
  BrickSlotsView slots[kMostGrids];
  TileBand band;
  BrickDemand demand[kMostGrids];  ///< without slotOf: no brick of the grid can be missing
  int ahead;  ///< missing bricks that a ray asks for besides those at which it waits
  std::uint32_t* waitingCount;  ///< null: no brick can be missing
  std::uint32_t* waiting;       ///< output: numbers of the tiles or entries that wait
};

/// Asks for missing bricks of all grids.
struct AskingGrids {
  const BrickDemand* demand;
  int left;  ///< number of further bricks that the ray asks for

  __device__ void entered(int grid, std::uint32_t slot) const { stamp(demand[grid], slot); }
  __device__ bool wantsMore(int grid, std::uint32_t brick, std::uint32_t slot) {
    askFor(demand[grid], brick, slot);
    return left-- > 0;
  }
};

/// Marches the ray of a pixel. \return whether it ends
template <int kGrids>
__device__ bool marchRay(const GridsDrawArguments& a, const TilePixel& pixel, int2 range,
                         GridsProgress& ray) {
  const MarchSamples samples =
      samplesOf(a.scene.scene, pixel.column, pixel.row,
                {a.band.firstSample + double(range.x), a.band.firstSample + double(range.y)});
  AskingGrids asking{a.demand, a.ahead};
  return marchGrids<kGrids>(a.scene, a.slots, samples, ray, asking);
}

template <int kGrids>
__global__ void __launch_bounds__(kMarchTilePixels)
    marchGridsKernel(const GridsDrawArguments a, const WaitingTiles<KeptGridsRay> w) {
  const TileWork<KeptGridsRay> work(w);
  const int2 range = a.band.ranges[work.tile];
  if (range.x > range.y) return;
  const auto march = [&](const TilePixel& pixel, GridsProgress& ray) {
    return marchRay<kGrids>(a, pixel, range, ray);
  };
  const bool ended = goOn<GridsProgress>(a.band, w, work, march, [&](const GridsProgress& ray) {
    return finished<kGrids>(a.scene, ray);
  });
  if (a.waitingCount != nullptr) listIfWaiting(ended, work.entry, a.waitingCount, a.waiting);
}

using GridsKernel = void (*)(GridsDrawArguments, WaitingTiles<KeptGridsRay>);
constexpr GridsKernel kKernels[kMostGrids] = {marchGridsKernel<1>, marchGridsKernel<2>,
                                              marchGridsKernel<3>, marchGridsKernel<4>};

/// Marches the rays that wait, or those of the whole band.
void marchBand(const GridsDrawArguments& a, const WaitingTiles<KeptGridsRay>& w,
               cudaStream_t stream) {
  const unsigned blocks = w.count == 0 ? unsigned(a.band.tiles()) : w.count;
  kKernels[a.grids - 1]<<<blocks, kMarchTilePixels, 0, stream>>>(a, w);
  check(cudaGetLastError(), "marching bricks of several grids");
}

using Stores = std::vector<std::unique_ptr<CellStore>>;

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
  /// The largest number of tiles that may go on. All bricks for which their rays wait must have
  /// room at the same time. Otherwise, rays that have a brick of one grid and wait for one of
  /// another could take turns for ever.
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
  static Stores storesOf(const std::vector<DrawnGrid>& grids, cudaStream_t stream) {
    Stores stores;
    for (const DrawnGrid& grid : grids)
      if (const auto* const drawn = std::get_if<DrawnField>(&grid))
        stores.push_back(storeOf(*drawn->field, drawn->voxels, stream));
      else
        stores.push_back(storeOf(*std::get<const SparseVolume*>(grid), stream));
    return stores;
  }

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
    const TileBand tiles = tileBand(o, band, firstSampleOf(*scene_), pixels);
    GridsDrawArguments arguments{.scene = *scene_,
                                 .grids = int(stores_.size()),
                                 .slots = {},
                                 .band = tiles,
                                 .demand = {},
                                 .ahead = 0,
                                 .waitingCount = nullptr,
                                 .waiting = nullptr};
    std::vector<CoveringBricks> covering;
    for (std::size_t g = 0; g < stores_.size(); ++g) {
      arguments.slots[g] = stores_[g]->slots();
      // Bricks that are known to be vacant do not count.
      const DeviceLevel& bricks = stores_[g]->level(0);
      const CoverView cover = coverViewOf(*scene_, g, o.resolution);
      covering.push_back({cover.view, cover.step, bricks.bricks(), bricks.first(), bricks.count(),
                          arguments.slots[g].slotOf});
    }
    setRanges(tiles, covering, stream());
    drawAndServe(o, arguments);
  }

  /// Draws, decodes the bricks that rays ask for and lets the rays continue, until none waits.
  void drawAndServe(const RenderOptions& o, GridsDrawArguments& arguments) {
    arguments.waiting = waiting_.found(std::size_t(arguments.band.tiles()));
    caches_.demand(0, arguments);
    marchBand(arguments, {}, stream());
    std::uint32_t count = caches_.serve(arguments), kept = 0;
    WaitingTiles<KeptGridsRay> tiles;
    for (int pass = 1; count + kept > 0; ++pass) {
      checkCancelled(o);
      tiles = pass == 1 ? waiting_.begin(count, false)
                        : waiting_.next(tiles, kept, count, caches_.mostTiles());
      kept += count - tiles.count;
      caches_.demand(pass, arguments);
      marchBand(arguments, tiles, stream());
      count = caches_.serve(arguments);
    }
  }

  bool decodesBricks() const override { return caches_.any() != nullptr; }
  void shareMemory(std::uint64_t left) override { caches_.limit(left, stores_); }
  std::size_t fixedBytes() const override {
    std::size_t bytes = tileBytes();
    for (const auto& store : stores_) {
      bytes += store->bytes();
      if (const BrickCache* const cache = store->cache())
        bytes += cache->fixedBytes() - cache->bytes();
    }
    return bytes;
  }
  std::size_t contentBytes() const override {
    std::size_t bytes = tileBytes() + waiting_.bytes();
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
};

}  // namespace

std::unique_ptr<Renderer> makeCudaGridsRenderer(const std::vector<DrawnGrid>& grids,
                                                const Device& device,
                                                const RendererLimits& limits) {
  return std::make_unique<GridsRenderer>(grids, device, limits);
}

}  // namespace esvr::cuda
