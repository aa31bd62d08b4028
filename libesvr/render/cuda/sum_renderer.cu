// The renderer of sums of ellipsoids: projects the ellipsoids, lists them by tile and bin
// (sum_frame.h), and has the lists drawn (draw_sums.cu). If memory is short, a picture is drawn in
// bands.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/cuda/device_buffer.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "esvr/error.h"
#include "render/cuda/cuda_renderers.h"
#include "render/cuda/march_renderer.cuh"
#include "render/cuda/sum_frame.h"
#include "render/picture.h"

namespace esvr::cuda {
namespace {

// Lists. An ellipsoid is first projected. Its entries are counted, each list gets its place in
// memory, and the lists are filled in any order.

constexpr int kTileSide = DrawTuning::kTileSide;

/// Factors that widen bounds, so that rounding them to float32 never excludes anything.
constexpr double kWider = 1.0 + 1e-6, kNarrower = 1.0 - 1e-6;

struct DeviceEllipsoids {
  const PackedEllipsoid* ellipsoids;
  std::uint32_t count;
  const Vec3* origins;       ///< origins of the chunks
  const RayKernel* kernels;  ///< one for all ellipsoids, or one for each
  std::int32_t ownKernels;   ///< 1 if each ellipsoid has its own kernel
};

/// The ellipsoids as the camera of a frame sees them.
struct SeenEllipsoids {
  EllipsoidView* views;
  Footprint* footprints;
  std::uint32_t* large;  ///< numbers of the ellipsoids in many lists, in any order
};

__device__ ScreenEllipse outlineIn(const Footprint& p) {
  return {p.column, p.row, double(p.xx), double(p.xy), double(p.yy), p.everywhere != 0};
}

__device__ Footprint footprintOf(const ScreenEllipse& o, const ScreenBounds& b) {
  return {o.column,
          o.row,
          float(o.xx * kWider),
          float(o.xy),
          float(o.yy * kWider),
          float(b.nearest * kNarrower),
          float(b.farthest * kWider),
          std::int16_t(b.firstColumn),
          std::int16_t(b.lastColumn),
          std::int16_t(b.firstRow),
          std::int16_t(b.lastRow),
          o.everywhere ? 1 : 0};
}

/// The number of a thread among those that list an ellipsoid together, and their count.
struct Lanes {
  int lane, count;
};

/// A range of pixel columns, or of bins.
struct Columns {
  int first, last;
};
/// The pixel columns that an ellipsoid may cover in a row of tiles. It and binsIn are not inlined,
/// because counting and filling must get the same result, bit by bit.
__device__ __noinline__ Columns columnsIn(const TileFrame& frame, const Footprint& p, int tileRow) {
  Columns c{p.firstColumn, p.lastColumn};
  if (p.everywhere) return c;
  const int lastRow = min(tileRow * kTileSide + kTileSide, frame.resolution.height) - 1;
  const PixelSpan span = columnsBetween(outlineIn(p), tileRow * kTileSide, lastRow);
  const int width = frame.resolution.width;
  if (!(span.low <= span.high)) return {1, 0};
  return {max(c.first, ellipsoid_math::firstPixel(span.low, width)),
          min(c.last, ellipsoid_math::lastPixel(span.high, width))};
}

/// The bins that an ellipsoid may reach in a tile, counted from the frame's first bin.
__device__ __noinline__ Columns binsIn(const TileFrame& frame, const Footprint& p, int tileColumn,
                                       int tileRow) {
  const int firstColumn = tileColumn * kTileSide, firstRow = tileRow * kTileSide;
  const UnitRange unit =
      unitRange(frame.view, firstColumn, min(firstColumn + kTileSide, frame.resolution.width) - 1,
                firstRow, min(firstRow + kTileSide, frame.resolution.height) - 1);
  const BinRange bins = binsOf(p.nearest, p.farthest, unit, frame.step);
  const std::int64_t last = frame.firstBin + frame.bins - 1;
  return {int(max(bins.first, frame.firstBin) - frame.firstBin),
          int(min(bins.last, last) - frame.firstBin)};
}

/// The tiles of the band that meet the bounding rectangle of an ellipsoid.
struct TileRectangle {
  int firstColumn, columns, firstRow, rows;
};
__device__ TileRectangle tilesOf(const TileFrame& frame, const Footprint& p) {
  const int firstRow = max(p.firstRow / kTileSide, frame.firstTileRow);
  const int lastRow = min(p.lastRow / kTileSide, frame.firstTileRow + frame.tileRows - 1);
  const int firstColumn = p.firstColumn / kTileSide;
  return {firstColumn, p.lastColumn / kTileSide - firstColumn + 1, firstRow,
          lastRow - firstRow + 1};
}

/// Calls visit(list) for each list that an ellipsoid belongs to. The number of a list is
/// tile * bins + bin.
template <class Visit>
__device__ void visitLists(const TileFrame& frame, const Footprint& p, Lanes lanes, Visit&& visit) {
  const TileRectangle tiles = tilesOf(frame, p);
  for (int t = lanes.lane; t < tiles.rows * tiles.columns; t += lanes.count) {
    const int row = tiles.firstRow + t / tiles.columns;
    const int column = tiles.firstColumn + t % tiles.columns;
    const Columns columns = columnsIn(frame, p, row);
    if (columns.first > min(columns.last, column * kTileSide + kTileSide - 1) ||
        columns.last < column * kTileSide)
      continue;
    const int tile = (row - frame.firstTileRow) * frame.tileColumns + column;
    const Columns bins = binsIn(frame, p, column, row);
    for (int bin = bins.first; bin <= bins.last; ++bin) visit(tile * frame.bins + bin);
  }
}

__device__ bool isSeen(const TileFrame& frame, const Footprint& p) {
  return p.firstRow <= p.lastRow && p.lastRow / kTileSide >= frame.firstTileRow &&
         p.firstRow / kTileSide < frame.firstTileRow + frame.tileRows;
}

__device__ bool inManyLists(const TileFrame& frame, const Footprint& p) {
  const TileRectangle tiles = tilesOf(frame, p);
  const float bins = (p.farthest - p.nearest) / float(frame.step * kBinSamples) + 1.0f;
  return float(tiles.columns) * float(tiles.rows) * bins > float(DrawTuning::kManyLists);
}

/// Calls visit(ellipsoid) for each ellipsoid that is in many lists, in all lanes of one warp.
template <class Visit>
__device__ void visitLarge(const FrameCounters& counters, const std::uint32_t* large,
                           Visit&& visit) {
  for (std::size_t i = warpNumber(); i < counters.large; i += warpCount()) visit(large[i]);
}

__device__ bool look(const TileFrame& frame, const DeviceEllipsoids& all, const SeenEllipsoids& out,
                     std::uint32_t i) {
  const PackedEllipsoid e = all.ellipsoids[i];
  const RayKernel kernel = all.kernels[all.ownKernels ? i : 0];
  const double radius = sqrt(double(kernel.cutoff));
  const SeenEllipsoid seen =
      seenBy(frame.view, e, difference(all.origins[e.chunk], frame.view.eye));
  ScreenExtent s = screenExtentOf(frame.view, seen, radius, frame.resolution);
  const bool any = visible(s.bounds);
  if (!any) s.bounds.firstRow = 1, s.bounds.lastRow = 0;
  const Footprint footprint = footprintOf(s.outline, s.bounds);
  out.footprints[i] = footprint;
  if (any) out.views[i] = viewOf(frame.view, seen, s.outline.everywhere, e.intensity, kernel);
  return any && isSeen(frame, footprint);
}

__global__ void __launch_bounds__(DrawTuning::kListThreads)
    viewKernel(const TileFrame frame, const DeviceEllipsoids all, const SeenEllipsoids out,
               const TileLists lists) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= all.count || !look(frame, all, out, i)) return;
  const Footprint own = out.footprints[i];
  if (inManyLists(frame, own))
    out.large[atomicAdd(&lists.counters->large, 1u)] = i;
  else
    visitLists(frame, own, {0, 1}, [&](int list) { atomicAdd(&lists.counts[list], 1u); });
}

__global__ void __launch_bounds__(DrawTuning::kListThreads)
    countLargeKernel(const TileFrame frame, const SeenEllipsoids seen, const TileLists lists) {
  visitLarge(*lists.counters, seen.large, [&](std::uint32_t ellipsoid) {
    visitLists(frame, seen.footprints[ellipsoid], {int(threadIdx.x) % kWarp, kWarp},
               [&](int list) { atomicAdd(&lists.counts[list], 1u); });
  });
}

__device__ void enter(const TileLists& lists, int list, std::uint32_t ellipsoid) {
  const std::uint32_t at = atomicAdd(&lists.ends[list], 1u);
  if (at < lists.entryCapacity) lists.entries[at] = ellipsoid;
}

__global__ void __launch_bounds__(DrawTuning::kListThreads)
    fillKernel(const TileFrame frame, std::uint32_t count, const SeenEllipsoids seen,
               const TileLists lists) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count || lists.counters->entries > lists.entryCapacity) return;
  const Footprint own = seen.footprints[i];
  if (isSeen(frame, own) && !inManyLists(frame, own))
    visitLists(frame, own, {0, 1}, [&](int list) { enter(lists, list, i); });
}

__global__ void __launch_bounds__(DrawTuning::kListThreads)
    fillLargeKernel(const TileFrame frame, const SeenEllipsoids seen, const TileLists lists) {
  if (lists.counters->entries > lists.entryCapacity) return;
  visitLarge(*lists.counters, seen.large, [&](std::uint32_t ellipsoid) {
    visitLists(frame, seen.footprints[ellipsoid], {int(threadIdx.x) % kWarp, kWarp},
               [&](int list) { enter(lists, list, ellipsoid); });
  });
}

/// Number of entries of many lists. Each list has fewer than 2^32 entries, but their sum may not.
using Entries = unsigned long long;

struct TileTotals {
  Entries entries = 0;
  std::uint32_t longestBin = 0, parts = 0;
};

__device__ Entries entriesOfPart(const TileFrame& frame, const std::uint32_t* counts, int part) {
  Entries entries = 0;
  const int end = min((part + 1) * frame.binsOfPart, frame.bins);
  for (int bin = part * frame.binsOfPart; bin < end; ++bin) entries += counts[bin];
  return entries;
}

__device__ TileTotals totalsOf(const TileFrame& frame, const std::uint32_t* counts) {
  TileTotals totals;
  for (int bin = 0; bin < frame.bins; ++bin)
    totals.longestBin = max(totals.longestBin, counts[bin]);
  for (int part = 0; part < frame.parts; ++part) {
    const Entries entries = entriesOfPart(frame, counts, part);
    totals.entries += entries;
    totals.parts += entries > 0 ? 1 : 0;
  }
  return totals;
}

/// Class of a number of entries; 0 has the longest lists.
__device__ int lengthClass(Entries entries) {
  const int log = 63 - __clzll((long long)(entries));
  return max(0, DrawTuning::kLengthClasses - 1 - log);
}

__device__ void planTile(const TileFrame& frame, const TileLists& lists, int tile,
                         const TileTotals& totals) {
  const std::uint32_t* counts = &lists.counts[std::size_t(tile) * frame.bins];
  lists.partsOfTile[tile] = totals.parts;
  lists.partsDone[tile] = 0;
  lists.closedAt[tile] = kNoResult;
  for (int part = 0; part < frame.parts; ++part) {
    std::uint32_t result = kNoResult;
    if (const Entries entries = entriesOfPart(frame, counts, part); entries > 0) {
      const int of = lengthClass(entries);
      const std::size_t room = std::size_t(frame.tiles()) * frame.parts;
      const std::uint32_t at = atomicAdd(&lists.counters->items[of], 1u);
      lists.items[of * room + at] = {std::uint32_t(tile), std::uint32_t(part)};
      if (totals.parts > 1) result = atomicAdd(&lists.counters->results, 1u);
    }
    lists.resultOf[std::size_t(tile) * frame.parts + part] = result;
  }
}

/// Each thread plans one tile. The lists of a tile may lie anywhere in memory, so a warp reserves
/// room with one atomic addition and no prefix sum over all tiles is needed.
__global__ void __launch_bounds__(DrawTuning::kListThreads)
    planKernel(const TileFrame frame, const TileLists lists) {
  const int tile = int(blockIdx.x * blockDim.x + threadIdx.x);
  const bool any = tile < frame.tiles();
  TileTotals totals;
  if (any) totals = totalsOf(frame, &lists.counts[std::size_t(tile) * frame.bins]);

  const Entries ofWarp = warpSum(totals.entries), below = warpSumBelow(totals.entries);
  Entries begin = 0;
  if (threadIdx.x % kWarp == 0 && ofWarp > 0) begin = atomicAdd(&lists.counters->entries, ofWarp);
  begin = __shfl_sync(kAllLanes, begin, 0) + below;
  if (!any) return;

  planTile(frame, lists, tile, totals);
  auto end = std::uint32_t(begin);  // 32 bits suffice wherever the entries fit into the buffer
  for (int bin = 0; bin < frame.bins; ++bin) {
    const std::size_t list = std::size_t(tile) * frame.bins + bin;
    lists.ends[list] = end;
    end += lists.counts[list];
  }
  if (totals.entries == 0) return;
  atomicAdd(&lists.counters->occupiedTiles, 1u);
  atomicMax(&lists.counters->longestTile, std::uint32_t(min(totals.entries, Entries{0xffffffffu})));
  atomicMax(&lists.counters->longestBin, totals.longestBin);
}

// The renderer.

/// Kernels number lists and their entries with signed 32-bit integers.
constexpr std::int64_t kMaxLists = std::int64_t{1} << 30;

/// Adds spare room, so that lists that grow from view to view do not need new memory each time.
std::size_t withSpare(std::size_t n) { return n + n / 4 + 1024; }

template <class... Buffers>
std::size_t bytesOf(const Buffers&... buffers) {
  return (buffers.bytes() + ...);
}

/// \throws DeviceError  there are more ellipsoids than 32-bit integers can number
std::vector<PackedEllipsoid> numbered(std::vector<PackedEllipsoid> ellipsoids) {
  if (ellipsoids.size() > std::size_t(std::numeric_limits<std::int32_t>::max()))
    throw DeviceError("drawing on the GPU: " + std::to_string(ellipsoids.size()) +
                      " ellipsoids are more than 2^31");
  return ellipsoids;
}

int tilesAlong(int pixels) { return (pixels + kTileSide - 1) / kTileSide; }

/// Device memory of a field, which is kept from picture to picture.
struct FieldMemory {
  FieldMemory(const Field& field, cudaStream_t stream)
      : ellipsoids(numbered(packed(field)), stream),
        origins(chunkOrigins(field), stream),
        kernels(rayKernels(field), stream),
        views(ellipsoids.size(), stream),
        footprints(ellipsoids.size(), stream),
        large(ellipsoids.size(), stream) {}

  DeviceBuffer<PackedEllipsoid> ellipsoids;
  DeviceBuffer<Vec3> origins;
  DeviceBuffer<RayKernel> kernels;
  DeviceBuffer<EllipsoidView> views;
  DeviceBuffer<Footprint> footprints;
  DeviceBuffer<std::uint32_t> large;

  [[nodiscard]] std::size_t bytes() const {
    return bytesOf(ellipsoids, origins, kernels, views, footprints, large);
  }
  [[nodiscard]] DeviceEllipsoids all() const {
    return {ellipsoids.data(), std::uint32_t(ellipsoids.size()), origins.data(), kernels.data(),
            kernels.size() > 1 ? 1 : 0};
  }
  [[nodiscard]] SeenEllipsoids seen() { return {views.data(), footprints.data(), large.data()}; }
};

/// Device memory of a band of the picture. It grows when a band needs more.
struct BandMemory {
  DeviceBuffer<FrameCounters> counters;
  DeviceBuffer<std::uint32_t> counts, ends, entries, sorted;
  DeviceBuffer<TilePart> items;
  DeviceBuffer<std::uint32_t> partsOfTile, partsDone, closedAt, resultOf;
  DeviceBuffer<RayState> results;
  DeviceBuffer<float4> pixels;

  [[nodiscard]] std::size_t bytes() const {
    return bytesOf(counters, counts, ends, entries, sorted, items, partsOfTile, partsDone, closedAt,
                   resultOf, results, pixels);
  }
  [[nodiscard]] TileLists lists() {
    return {.counters = counters.data(),
            .counts = counts.data(),
            .ends = ends.data(),
            .entries = entries.data(),
            .sorted = sorted.data(),
            .entryCapacity = entries.size(),
            .sortedCapacity = sorted.size(),
            .items = items.data(),
            .partsOfTile = partsOfTile.data(),
            .partsDone = partsDone.data(),
            .closedAt = closedAt.data(),
            .resultOf = resultOf.data(),
            .results = results.data(),
            .resultCapacity = results.size() / DrawTuning::kTilePixels};
  }
};

class SumRenderer final : public Renderer {
 public:
  SumRenderer(const Field& field, const Device& device, const RendererLimits& limits,
              const RevoxeliseOptions& voxels)
      : background_(field.background),
        limits_(limits),
        voxelRule_(makeVoxelRule(field.background, voxels)),
        box_(supportBox(field)),
        stream_(streamOn(device)),
        multiprocessors_(multiprocessorsOf(device)),
        field_(field, stream_.get()),
        parts_(limits.depthParts) {}

  Image draw(const RenderOptions& options) override {
    Image image{options.resolution.width, options.resolution.height, {}};
    drawFrame(options, &image);
    return image;
  }
  void drawOnDevice(const RenderOptions& options) override { drawFrame(options, nullptr); }
  FrameStats stats() const override { return stats_; }

 private:
  /// A band of the picture, in rows of tiles.
  struct Band {
    int first, count;
  };
  /// What all bands of a picture share.
  struct Scene {
    const RenderOptions& options;
    View view;
    BinRange bins;
  };

  void drawFrame(const RenderOptions& options, Image* image);
  void drawBand(const Scene& scene, Band band, Image* image);
  [[nodiscard]] TileFrame frameOf(const Scene& scene, Band band) const;
  [[nodiscard]] std::size_t fixedBytes() const { return field_.bytes() + table_.bytes(); }
  [[nodiscard]] std::size_t bandBytes(const TileFrame& frame) const;
  void reserve(const TileFrame& frame);
  void list(const TileFrame& frame);
  void fill(const TileFrame& frame);
  /// Blocks of threads that list the ellipsoids in many lists.
  [[nodiscard]] unsigned largeBlocks() const {
    return unsigned(multiprocessors_ * DrawTuning::kListBlocksPerMultiprocessor);
  }
  [[nodiscard]] int chosenParts(const TileFrame& frame);
  [[nodiscard]] FrameCounters drawOnce(const Scene& scene, const TileFrame& frame);
  void grow(const FrameCounters& counters);
  [[nodiscard]] FrameCounters readCounters();
  void count(const TileFrame& frame, const FrameCounters& counters);
  void download(const TileFrame& frame, Image& image);

  float background_;
  RendererLimits limits_;
  VoxelRule voxelRule_;
  std::optional<PlaceBox> box_;
  Stream stream_;
  int multiprocessors_;
  FieldMemory field_;
  BandMemory band_;
  Event begin_, listed_, drawn_;
  DeviceTable table_;
  int parts_;  ///< parts of the depth; 0: not yet chosen
  std::uint64_t tiles_ = 0, occupied_ = 0;
  FrameStats stats_;
};

void SumRenderer::drawFrame(const RenderOptions& options, Image* image) {
  checkRenderOptions(options);
  Scene scene{options, viewOf(options, box_.value_or(kNoPlaces)), {0, -1}};
  refuseShading(options);
  if (image != nullptr)
    image->rgba.assign(std::size_t(4) * std::size_t(image->width) * std::size_t(image->height),
                       0.0f);
  stats_ = {.deviceBytes = stats_.deviceBytes};
  tiles_ = occupied_ = 0;
  if (box_) scene.bins = binsWithin(*box_, scene.view, options.step);
  if (scene.bins.last < scene.bins.first) return;
  checkRayLength(scene.bins);
  table_.update(options.transfer, samplingOf(options), stream_.get());
  drawBand(scene, {0, tilesAlong(options.resolution.height)}, image);
}

void SumRenderer::drawBand(const Scene& scene, Band band, Image* image) {
  checkCancelled(scene.options);
  TileFrame f = frameOf(scene, band);
  const bool tooMany = std::int64_t(f.tiles()) * f.bins > kMaxLists;
  const auto tooLarge = [&](std::size_t bytes) {
    return limits_.maxBytes != 0 && bytes > limits_.maxBytes;
  };
  const auto halves = [&] {
    if (band.count == 1)
      throw DeviceError("drawing on the GPU needs more than " + std::to_string(limits_.maxBytes) +
                        " bytes; allow more memory or draw a smaller picture");
    band_ = {};
    drawBand(scene, {band.first, band.count / 2}, image);
    drawBand(scene, {band.first + band.count / 2, band.count - band.count / 2}, image);
  };
  if (tooMany || tooLarge(fixedBytes() + bandBytes(f))) return halves();
  reserve(f);
  if (parts_ == 0) {
    parts_ = chosenParts(f);
    f = frameOf(scene, band);
    reserve(f);
  }
  FrameCounters counters = drawOnce(scene, f);
  while (!listsFit(counters, band_.lists())) {
    grow(counters);
    if (tooLarge(fixedBytes() + band_.bytes())) return halves();
    counters = drawOnce(scene, f);
  }
  count(f, counters);
  if (image != nullptr) download(f, *image);
}

TileFrame SumRenderer::frameOf(const Scene& scene, Band band) const {
  const Resolution resolution = scene.options.resolution;
  const int columns = tilesAlong(resolution.width);
  const std::int64_t bins = scene.bins.last - scene.bins.first + 1;
  if (bins > kMaxLists / columns)
    throw UsageError("rays of " + std::to_string(bins * kBinSamples) +
                     " samples are too long for so wide a picture; take a longer step");
  // The depth at which a ray stops depends on all samples before it, so there are no parts.
  const bool whole = scene.options.mode == RenderMode::kDepth;
  const int parts = whole ? 1 : std::clamp(parts_, 1, int(bins));
  return {.view = scene.view,
          .resolution = resolution,
          .step = scene.options.step,
          .tileColumns = columns,
          .firstTileRow = band.first,
          .tileRows = band.count,
          .firstBin = scene.bins.first,
          .bins = int(bins),
          .parts = parts,
          .binsOfPart = (int(bins) + parts - 1) / parts};
}

/// Bytes of the buffers that reserve() makes. Entries of lists and results of parts are not
/// included, because their number is known only after counting.
std::size_t SumRenderer::bandBytes(const TileFrame& f) const {
  const std::size_t tiles = std::size_t(f.tiles());
  const std::size_t ofParts =
      std::size_t(f.parts) *
      (DrawTuning::kLengthClasses * sizeof(TilePart) + sizeof(std::uint32_t));
  const std::size_t ofLists = std::size_t(f.bins) * 2 * sizeof(std::uint32_t);
  return tiles *
         (ofParts + ofLists + 3 * sizeof(std::uint32_t) + DrawTuning::kTilePixels * sizeof(float4));
}

void SumRenderer::reserve(const TileFrame& f) {
  const cudaStream_t stream = stream_.get();
  const std::size_t tiles = std::size_t(f.tiles()), lists = tiles * std::size_t(f.bins);
  const std::size_t parts = tiles * std::size_t(f.parts);
  const int rows =
      std::min(f.tileRows * kTileSide, f.resolution.height - f.firstTileRow * kTileSide);
  makeRoom(band_.counters, 1, stream);
  makeRoom(band_.counts, lists, stream);
  makeRoom(band_.ends, lists, stream);
  makeRoom(band_.items, parts * DrawTuning::kLengthClasses, stream);
  for (auto* ofTile : {&band_.partsOfTile, &band_.partsDone, &band_.closedAt})
    makeRoom(*ofTile, tiles, stream);
  makeRoom(band_.resultOf, parts, stream);
  makeRoom(band_.pixels, std::size_t(rows) * std::size_t(f.resolution.width), stream);
}

/// Clears the counters, projects the ellipsoids, counts their list entries and plans the work.
void SumRenderer::list(const TileFrame& f) {
  const cudaStream_t stream = stream_.get();
  band_.counters.setZero();
  check(
      cudaMemsetAsync(band_.counts.data(), 0,
                      std::size_t(f.tiles()) * std::size_t(f.bins) * sizeof(std::uint32_t), stream),
      "clearing counts");
  const DeviceEllipsoids all = field_.all();
  const SeenEllipsoids seen = field_.seen();
  const TileLists lists = band_.lists();
  const unsigned threads = DrawTuning::kListThreads;
  if (all.count > 0) {
    viewKernel<<<blocksFor(all.count, threads), threads, 0, stream>>>(f, all, seen, lists);
    check(cudaGetLastError(), "looking at ellipsoids");
    countLargeKernel<<<largeBlocks(), threads, 0, stream>>>(f, seen, lists);
    check(cudaGetLastError(), "counting the lists of large ellipsoids");
  }
  planKernel<<<blocksFor(std::size_t(f.tiles()), threads), threads, 0, stream>>>(f, lists);
  check(cudaGetLastError(), "planning tiles");
}

/// Fills the lists. It does nothing if the entries exceed the capacity.
void SumRenderer::fill(const TileFrame& f) {
  const cudaStream_t stream = stream_.get();
  const auto count = std::uint32_t(field_.ellipsoids.size());
  const unsigned threads = DrawTuning::kListThreads;
  if (count == 0) return;
  fillKernel<<<blocksFor(count, threads), threads, 0, stream>>>(f, count, field_.seen(),
                                                                band_.lists());
  check(cudaGetLastError(), "listing ellipsoids");
  fillLargeKernel<<<largeBlocks(), threads, 0, stream>>>(f, field_.seen(), band_.lists());
  check(cudaGetLastError(), "listing large ellipsoids");
}

FrameCounters SumRenderer::readCounters() {
  FrameCounters counters{};
  band_.counters.download(std::span<FrameCounters>(&counters, 1));
  return counters;
}

/// Number of parts into which the depth of tiles is divided. It is large enough that no tile has
/// much more work in one part than the average block has.
int SumRenderer::chosenParts(const TileFrame& f) {
  list(f);
  const FrameCounters c = readCounters();
  if (c.entries == 0) return 1;
  const double blocks = double(multiprocessors_) * DrawTuning::kBlocksPerMultiprocessor;
  const double share = double(c.entries) / blocks;
  return int(std::clamp(std::ceil(double(c.longestTile) / (2.0 * share)), 1.0,
                        double(RendererLimits::kMaxDepthParts)));
}

FrameCounters SumRenderer::drawOnce(const Scene& scene, const TileFrame& f) {
  const cudaStream_t stream = stream_.get();
  begin_.record(stream);
  list(f);
  fill(f);
  listed_.record(stream);
  band_.pixels.setZero();
  launchDrawSums({.frame = f,
                  .lists = band_.lists(),
                  .rule = sampleRule(scene.options, table_.view(), background_),
                  .voxelRule = voxelRule_,
                  .clip = clipOf(scene.options),
                  .views = field_.views.data(),
                  .footprints = field_.footprints.data(),
                  .pixels = band_.pixels.data()},
                 multiprocessors_, stream);
  drawn_.record(stream);
  return readCounters();
}

void SumRenderer::grow(const FrameCounters& c) {
  if (c.entries > std::uint64_t(kMaxLists))
    throw DeviceError("drawing on the GPU: " + std::to_string(c.entries) +
                      " entries are more than the lists of ellipsoids can hold");
  const cudaStream_t stream = stream_.get();
  if (c.entries > band_.entries.size()) makeRoom(band_.entries, withSpare(c.entries), stream);
  if (needSorting(c)) makeRoom(band_.sorted, band_.entries.size(), stream);
  if (std::uint64_t(c.results) * DrawTuning::kTilePixels > band_.results.size())
    makeRoom(band_.results, std::size_t(c.results + c.results / 4) * DrawTuning::kTilePixels,
             stream);
}

void SumRenderer::count(const TileFrame& f, const FrameCounters& c) {
  tiles_ += std::uint64_t(f.tiles()), occupied_ += c.occupiedTiles;
  stats_.listMs += listed_.millisecondsSince(begin_);
  stats_.drawMs += drawn_.millisecondsSince(listed_);
  stats_.listEntries += c.entries;
  stats_.occupancy = double(occupied_) / double(tiles_);
  stats_.depthParts = f.parts;
  stats_.deviceBytes = std::max<std::uint64_t>(stats_.deviceBytes, fixedBytes() + band_.bytes());
}

void SumRenderer::download(const TileFrame& f, Image& image) {
  const int firstRow = f.firstTileRow * kTileSide;
  const int rows = std::min(f.tileRows * kTileSide, f.resolution.height - firstRow);
  const std::size_t width = std::size_t(f.resolution.width);
  check(cudaMemcpyAsync(&image.rgba[4 * width * std::size_t(firstRow)], band_.pixels.data(),
                        width * std::size_t(rows) * sizeof(float4), cudaMemcpyDeviceToHost,
                        stream_.get()),
        "copying a picture from the device");
  stream_.synchronize();
}

}  // namespace

std::unique_ptr<Renderer> makeCudaSumRenderer(const Field& field, const Device& device,
                                              const RendererLimits& limits,
                                              const RevoxeliseOptions& voxels) {
  return std::make_unique<SumRenderer>(field, device, limits, voxels);
}

}  // namespace esvr::cuda
