// Draws the bricks of a field or of a volume. Each ray is marched through the range of samples in
// which the rays of its tile may meet bricks. Rays that meet a missing brick ask for it and wait;
// they continue in later passes.
#include <functional>
#include <optional>

#include "core/cuda/runtime.h"
#include "render/cuda/cuda_renderers.h"
#include "render/cuda/march_renderer.cuh"
#include "render/picture.h"

namespace esvr::cuda {
namespace {

struct DrawArguments {
  LevelScene scene;  ///< tables are on the device
  BrickSlotsView slots;
  TileBand band;  ///< its samples are those of the coarsest level
  BrickDemand demand;
  std::uint32_t* waiting;  ///< output: numbers of the tiles or entries that wait
};

/// Asks for missing bricks.
struct Asking {
  const BrickDemand& demand;
  int left;  ///< number of further bricks that the ray asks for

  __device__ void entered(std::uint32_t slot) const { stamp(demand, slot); }
  __device__ bool wantsMore(std::uint32_t brick, std::uint32_t slot) {
    askFor(demand, brick, slot);
    return left-- > 0;
  }
};

/// Marches the ray of a pixel. \return whether it ends
template <MarchCode kCode>
__device__ bool marchRay(const DrawArguments& a, const TilePixel& pixel, int2 range,
                         RayProgress& ray) {
  const double side = LevelFrame{a.scene.bounds.last}.side();
  const SampleRange wanted{(a.band.firstSample + double(range.x)) * side,
                           (a.band.firstSample + double(range.y)) * side};
  Asking asking{a.demand, a.demand.ahead};
  ray.ray.first = 0;  // so that the code for parts of rays is left out
  return marchLevels<kCode>(a.scene, a.slots, pixel.column, pixel.row, wanted, ray, asking);
}

/// Blocks that run on a multiprocessor at the same time. More leave fewer registers to each: 16
/// were faster than 12 by up to 9 % for scenes of one level, and 8 faster than 16 by 2 % for others
/// (H200).
constexpr int kBlocksOfOne = 16, kBlocksOfMany = 8;

/// The first pass and later ones share the code, because two kernels could be compiled to different
/// roundings.
template <bool kHasOneLevel, bool kIsUsual, bool kIsShaded>
__global__ void __launch_bounds__(kMarchTilePixels,
                                  kHasOneLevel && !kIsShaded ? kBlocksOfOne : kBlocksOfMany)
    marchKernel(const DrawArguments a, const WaitingTiles<KeptRay> w) {
  const TileWork<KeptRay> work(w);
  const int2 range = a.band.ranges[work.tile];
  if (range.x > range.y) return;
  const auto march = [&](const TilePixel& pixel, RayProgress& ray) {
    if (kIsShaded && !work.isNew) ray.shade = w.shades[work.ray()];
    const bool ended = marchRay<MarchCode{kHasOneLevel, kIsUsual, kIsShaded}>(a, pixel, range, ray);
    if (kIsShaded && work.keeps) w.shades[work.ray()] = ray.shade;
    return ended;
  };
  const bool ended = goOn<RayProgress>(
      a.band, w, work, march, [&](const RayProgress& ray) { return finished(a.scene, ray); });
  if (a.demand.slotOf != nullptr)
    listIfWaiting(ended, work.entry, &a.demand.counts->waiting, a.waiting);
}

using MarchKernel = void (*)(DrawArguments, WaitingTiles<KeptRay>);

MarchKernel kernelFor(const MarchCode& code) {
  if (code.isShaded)
    return code.hasOneLevel ? marchKernel<true, false, true> : marchKernel<false, false, true>;
  if (code.hasOneLevel)
    return code.isUsual ? marchKernel<true, true, false> : marchKernel<true, false, false>;
  return code.isUsual ? marchKernel<false, true, false> : marchKernel<false, false, false>;
}

/// Marches the rays that wait. Without tiles, the rays of the whole band are marched from their
/// first samples, and rays that must wait are not kept.
void marchBand(const DrawArguments& a, const WaitingTiles<KeptRay>& w, cudaStream_t stream) {
  const unsigned blocks = w.count == 0 ? unsigned(a.band.tiles()) : w.count;
  kernelFor(codeFor(a.scene))<<<blocks, kMarchTilePixels, 0, stream>>>(a, w);
  check(cudaGetLastError(), "marching bricks");
}

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
    const DeviceLevel& coarsest = store_->level(scene_->bounds.last);
    const View view = scene_->at(scene_->last()).view;
    const TileBand tiles = tileBand(
        o, band, double(binsWithin(coarsest.box(), view, o.step).first) * kBinSamples, pixels);
    // The bricks of the coarsest level, which are the fewest. Those that are known to be vacant do
    // not count. If there are several levels, they do: means may be the background where voxels are
    // not.
    const CoveringBricks bricks{view,
                                o.step,
                                coarsest.bricks(),
                                coarsest.first(),
                                coarsest.count(),
                                scene_->bounds.oneLevel() ? store_->slots().slotOf : nullptr};
    setRanges(tiles, {&bricks, 1}, stream());
    DrawArguments arguments{*scene_, store_->slots(), tiles, {}, nullptr};
    if (store_->cache() == nullptr)
      marchBand(arguments, {}, stream());
    else
      drawAndServe(o, arguments, *store_->cache());
  }

  /// Draws, decodes the bricks that rays ask for and lets the rays continue, until none waits.
  void drawAndServe(const RenderOptions& o, DrawArguments arguments, BrickCache& cache) {
    arguments.waiting = waiting_.found(std::size_t(arguments.band.tiles()));
    arguments.demand = cache.demand(0);
    marchBand(arguments, {}, stream());
    auto counts = cache.counts();
    WaitingTiles<KeptRay> tiles;
    for (int pass = 1; counts.waiting > 0; ++pass) {
      checkCancelled(o);
      tiles = pass == 1 ? waiting_.begin(counts.waiting, arguments.scene.scene.isShaded)
                        : waiting_.next(tiles, 0, counts.waiting, counts.waiting);
      cache.serve(counts, arguments.scene.bounds);
      arguments.slots = cache.slots();
      arguments.demand = cache.demand(pass);
      marchBand(arguments, tiles, stream());
      counts = cache.counts();
    }
  }

  bool decodesBricks() const override { return store_->cache() != nullptr; }
  void shareMemory(std::uint64_t left) override {
    if (store_->cache() != nullptr) store_->cache()->limit(left);
  }
  std::size_t fixedBytes() const override {
    const BrickCache* const cache = store_->cache();
    const std::size_t content = store_->bytes() + tileBytes();
    return cache == nullptr ? content : content - cache->bytes() + cache->fixedBytes();
  }
  std::size_t contentBytes() const override {
    return store_->bytes() + tileBytes() + waiting_.bytes();
  }
  std::size_t bytesOfRow(Resolution r) const override {
    return bytesOfTileRow<KeptRay>(r, store_->cache() != nullptr, scene_->scene.isShaded) /
               kMarchTileSide +
           1;
  }

  std::unique_ptr<CellStore> store_;
  std::optional<LevelScene> scene_;  ///< of the picture that is drawn
  WaitingMemory<KeptRay> waiting_;
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
