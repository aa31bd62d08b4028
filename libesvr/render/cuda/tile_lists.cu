#include "core/cuda/reduce.cuh"
#include "core/cuda/thread_number.cuh"
#include "render/cuda/tile_frame.h"

namespace esvr::cuda {
namespace {

constexpr int kSide = DrawTuning::kTileSide;

/// Factors that widen bounds, so that rounding them to float32 never excludes anything.
constexpr double kWider = 1.0 + 1e-6, kNarrower = 1.0 - 1e-6;

unsigned blocksOf(std::size_t items) { return blocksFor(items, DrawTuning::kListThreads); }

unsigned largeBlocks(int multiprocessors) {
  return unsigned(multiprocessors * DrawTuning::kListBlocksPerMultiprocessor);
}

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
  const int lastRow = min(tileRow * kSide + kSide, frame.resolution.height) - 1;
  const PixelSpan span = columnsBetween(outlineIn(p), tileRow * kSide, lastRow);
  const int width = frame.resolution.width;
  if (!(span.low <= span.high)) return {1, 0};
  return {max(c.first, ellipsoid_math::firstPixel(span.low, width)),
          min(c.last, ellipsoid_math::lastPixel(span.high, width))};
}

/// The bins that an ellipsoid may reach in a tile, counted from the frame's first bin.
__device__ __noinline__ Columns binsIn(const TileFrame& frame, const Footprint& p, int tileColumn,
                                       int tileRow) {
  const int firstColumn = tileColumn * kSide, firstRow = tileRow * kSide;
  const UnitRange unit =
      unitRange(frame.view, firstColumn, min(firstColumn + kSide, frame.resolution.width) - 1,
                firstRow, min(firstRow + kSide, frame.resolution.height) - 1);
  ScreenBounds b{};
  b.nearest = p.nearest, b.farthest = p.farthest;
  const BinRange bins = binsOf(b, unit, frame.step);
  const std::int64_t last = frame.firstBin + frame.bins - 1;
  return {int(max(bins.first, frame.firstBin) - frame.firstBin),
          int(min(bins.last, last) - frame.firstBin)};
}

/// The tiles of the band that meet the bounding rectangle of an ellipsoid.
struct TileRectangle {
  int firstColumn, columns, firstRow, rows;
};
__device__ TileRectangle tilesOf(const TileFrame& frame, const Footprint& p) {
  const int firstRow = max(p.firstRow / kSide, frame.firstTileRow);
  const int lastRow = min(p.lastRow / kSide, frame.firstTileRow + frame.tileRows - 1);
  const int firstColumn = p.firstColumn / kSide;
  return {firstColumn, p.lastColumn / kSide - firstColumn + 1, firstRow, lastRow - firstRow + 1};
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
    if (columns.first > min(columns.last, column * kSide + kSide - 1) ||
        columns.last < column * kSide)
      continue;
    const int tile = (row - frame.firstTileRow) * frame.tileColumns + column;
    const Columns bins = binsIn(frame, p, column, row);
    for (int bin = bins.first; bin <= bins.last; ++bin) visit(tile * frame.bins + bin);
  }
}

__device__ bool isSeen(const TileFrame& frame, const Footprint& p) {
  return p.firstRow <= p.lastRow && p.lastRow / kSide >= frame.firstTileRow &&
         p.firstRow / kSide < frame.firstTileRow + frame.tileRows;
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

}  // namespace

void launchView(const TileFrame& frame, const DeviceEllipsoids& ellipsoids,
                const SeenEllipsoids& seen, const TileLists& lists, int multiprocessors,
                cudaStream_t stream) {
  if (ellipsoids.count == 0) return;
  viewKernel<<<blocksOf(ellipsoids.count), DrawTuning::kListThreads, 0, stream>>>(frame, ellipsoids,
                                                                                  seen, lists);
  check(cudaGetLastError(), "looking at ellipsoids");
  countLargeKernel<<<largeBlocks(multiprocessors), DrawTuning::kListThreads, 0, stream>>>(
      frame, seen, lists);
  check(cudaGetLastError(), "counting the lists of large ellipsoids");
}

void launchPlan(const TileFrame& frame, const TileLists& lists, cudaStream_t stream) {
  planKernel<<<blocksOf(std::size_t(frame.tiles())), DrawTuning::kListThreads, 0, stream>>>(frame,
                                                                                            lists);
  check(cudaGetLastError(), "planning tiles");
}

void launchFill(const TileFrame& frame, std::uint32_t count, const SeenEllipsoids& seen,
                const TileLists& lists, int multiprocessors, cudaStream_t stream) {
  if (count == 0) return;
  fillKernel<<<blocksOf(count), DrawTuning::kListThreads, 0, stream>>>(frame, count, seen, lists);
  check(cudaGetLastError(), "listing ellipsoids");
  fillLargeKernel<<<largeBlocks(multiprocessors), DrawTuning::kListThreads, 0, stream>>>(
      frame, seen, lists);
  check(cudaGetLastError(), "listing large ellipsoids");
}

}  // namespace esvr::cuda
