// The renderer that marches rays through bricks of cells on a CUDA device, which are decoded from a
// field when a ray asks for them.

#include <algorithm>
#include <cmath>

#include "render/cuda/brick_cache.h"
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
      : stream_(stream), found_(stream), entries_(stream), tiles_(stream), rays_(stream) {}

  /// Memory for the numbers of waiting tiles or entries.
  std::uint32_t* found(std::size_t tiles) { return found_.reserve(tiles); }

  /// Takes the tiles that were found after the first pass; their rays begin anew.
  WaitingTiles begin(std::uint32_t count) {
    copy(tiles_.reserve(count), count);
    rays_.reserve(std::size_t(count) * kMarchTilePixels);
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
  GrowingBuffer<RayProgress> rays_;
};

class CellRenderer final : public MarchRenderer {
 public:
  CellRenderer(const CellField& field, const Device& device, const RendererLimits& limits)
      : MarchRenderer(device, limits),
        origin_{double(field.table.origin.x), double(field.table.origin.y),
                double(field.table.origin.z)},
        background_(field.rule.background),
        box_(cellsOf(field.table)),
        cells_(field, stream()),
        cache_(cells_, stream()),
        waiting_(stream()) {}

  void forget() override { cache_.forget(); }

 private:
  static_assert(kBandRows % kMarchTileSide == 0);

  void launch(const RenderOptions& o, Band band, float4* pixels) override {
    if (cells_.count() == 0) return;
    const BrickDrawArguments arguments = argumentsOf(o, band, pixels);
    launchRanges(arguments, stream());
    launchMarch(arguments, {}, stream());
    serveAll(o, arguments);
  }

  BrickDrawArguments argumentsOf(const RenderOptions& o, Band band, float4* pixels) {
    View view(o.camera, o.resolution);
    view.eye = difference(view.eye, origin_);
    ClipBox clip = clipOf(o);
    clip.box = {difference(clip.box.low, origin_), difference(clip.box.high, origin_)};
    const int tileRows = tilesAlong(band.rows);
    const std::size_t tiles = std::size_t(tileRows) * std::size_t(tilesAlong(o.resolution.width));
    makeRoom(ranges_, tiles, stream());
    return {.table = cells_.table(),
            .slots = cache_.slots(),
            .bricks = cells_.bricks(),
            .count = cells_.count(),
            .scene = {view, box_, o.step, clip, sampleRule(o, table().view(), background_)},
            .resolution = o.resolution,
            .firstTileRow = band.firstRow / kMarchTileSide,
            .tileRows = tileRows,
            .ranges = ranges_.data(),
            .firstSample = double(binsWithin(box_, view, o.step).first) * kBinSamples,
            .pixels = pixels,
            .demand = cache_.demand(),
            .waiting = waiting_.found(tiles)};
  }

  /// Decodes the bricks that rays ask for and lets the rays continue, until none waits.
  void serveAll(const RenderOptions& o, BrickDrawArguments arguments) {
    auto counts = cache_.counts();
    for (bool isFirst = true; counts.waiting > 0; isFirst = false) {
      checkCancelled(o);
      const WaitingTiles tiles =
          isFirst ? waiting_.begin(counts.waiting) : waiting_.next(counts.waiting);
      cache_.serve(counts.bricks);
      arguments.slots = cache_.slots();
      arguments.demand = cache_.demand();
      launchMarch(arguments, tiles, stream());
      counts = cache_.counts();
    }
  }

  static int tilesAlong(int pixels) { return (pixels + kMarchTileSide - 1) / kMarchTileSide; }

  void shareMemory(std::uint64_t left) override { cache_.limit(left); }
  std::size_t fixedBytes() const override {
    return cells_.bytes() + ranges_.bytes() + waiting_.bytes() + BrickCache::kPageBytes;
  }
  std::size_t contentBytes() const override {
    return cells_.bytes() + cache_.bytes() + ranges_.bytes() + waiting_.bytes();
  }
  std::size_t bytesOfRow(Resolution r) const override {
    const std::size_t ofTile =
        sizeof(int2) + kMarchTilePixels * sizeof(RayProgress) + 3 * sizeof(std::uint32_t);
    return std::size_t(tilesAlong(r.width)) * ofTile / kMarchTileSide + 1;
  }

  Vec3 origin_;
  float background_;
  PlaceBox box_;  ///< box of the cells, relative to the origin
  DeviceCells cells_;
  BrickCache cache_;
  Waiting waiting_;
  DeviceBuffer<int2> ranges_;
};

}  // namespace

std::unique_ptr<Renderer> makeCudaCellRenderer(const Field& field, const Device& device,
                                               const RendererLimits& limits,
                                               const RevoxeliseOptions& voxels) {
  return std::make_unique<CellRenderer>(makeCellField(field, voxels), device, limits);
}

}  // namespace esvr::cuda
