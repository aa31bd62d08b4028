#include "core/cuda/check.h"
#include "render/cuda/tile_frame.h"

namespace esvr::cuda {
namespace {

constexpr int kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffu;
constexpr int kSide = DrawTuning::kTileSide, kThreads = DrawTuning::kTilePixels;
constexpr int kStage = DrawTuning::kStage;
constexpr int kWarpsAcross = kSide / DrawTuning::kWarpColumns;
static_assert(DrawTuning::kWarpColumns * DrawTuning::kWarpRows == kWarp);
static_assert(kStage == kWarp, "a lane of each warp looks at one staged ellipsoid");

/// Where a staged ellipsoid lies from the tile's first pixel and the bin's first sample.
struct Placement {
  float dx, dy;
  float depth, middleAhead;
  int firstColumn, lastColumn, firstRow, lastRow;  ///< pixels of the tile that it may cover
};

struct Shared {
  /// A thread's own samples lie kThreads apart: whatever sample it is, a warp meets no bank twice.
  float sums[kBinSamples * kThreads];
  PrimitiveView views[kStage];
  Placement placements[kStage];
  std::uint32_t ids[kThreads], sortedIds[kThreads];
  TilePart item;
  int hasItem;
  int isLast;
};

/// A thread's pixel.
struct Pixel {
  int column, row;  ///< in the tile
  bool inPicture;
  RayScale scale;
  /// Samples that the clip box leaves, counted from the frame's first.
  float firstSample, lastSample;
};

/// Pixels of a warp, all lanes' alike.
struct WarpRectangle {
  int firstColumn, firstRow;

  __device__ bool meets(const Placement& p) const {
    return p.firstColumn < firstColumn + DrawTuning::kWarpColumns && p.lastColumn >= firstColumn &&
           p.firstRow < firstRow + DrawTuning::kWarpRows && p.lastRow >= firstRow;
  }
};

__device__ WarpRectangle warpRectangle() {
  const int warp = int(threadIdx.x) / kWarp;
  return {warp % kWarpsAcross * DrawTuning::kWarpColumns,
          warp / kWarpsAcross * DrawTuning::kWarpRows};
}

/// What a block keeps of its tile while it draws a part of it.
struct TileWork {
  int firstColumn, firstRow;  ///< pixels of the picture
  double middleUnit;          ///< samples for each unit along forward, on the tile's middle ray
};

__device__ TileWork workOf(const TileFrame& frame, std::uint32_t tile) {
  TileWork w;
  w.firstColumn = int(tile) % frame.tileColumns * kSide;
  w.firstRow = (int(tile) / frame.tileColumns + frame.firstTileRow) * kSide;
  constexpr double kMiddle = (kSide - 1) / 2.0;
  w.middleUnit = frame.view.unitAlong(frame.view.planeX(w.firstColumn + kMiddle),
                                      frame.view.planeY(w.firstRow + kMiddle)) /
                 frame.step;
  return w;
}

__device__ Pixel pixelOf(const TileFrame& frame, const TileWork& work) {
  const WarpRectangle rectangle = warpRectangle();
  const int lane = int(threadIdx.x) % kWarp;
  Pixel p;
  p.column = rectangle.firstColumn + lane % DrawTuning::kWarpColumns;
  p.row = rectangle.firstRow + lane / DrawTuning::kWarpColumns;
  const int column = work.firstColumn + p.column, row = work.firstRow + p.row;
  p.inPicture = column < frame.resolution.width && row < frame.resolution.height;
  const double unit =
      frame.view.unitAlong(frame.view.planeX(column), frame.view.planeY(row)) / frame.step;
  p.scale = {float(unit), float(unit - work.middleUnit)};
  return p;
}

__device__ void clipTo(const ClipBox& clip, const TileFrame& frame, const TileWork& work,
                       Pixel& p) {
  const Ray ray = frame.view.ray(work.firstColumn + p.column, work.firstRow + p.row);
  const SampleRange range = samplesIn(ray, clip, frame.step);
  const double first = double(frame.firstBin) * kBinSamples;
  p.firstSample = float(range.first - first), p.lastSample = float(range.last - first);
}

/// Increasing order, so that sums have one order whatever filled the list: each id goes where the
/// number of smaller ones says.
__device__ void sortInShared(Shared& s, std::uint32_t n) {
  const std::uint32_t t = threadIdx.x;
  if (t < n) {
    const std::uint32_t own = s.ids[t];
    std::uint32_t smaller = 0;
    for (std::uint32_t j = 0; j < n; ++j) smaller += s.ids[j] < own ? 1 : 0;
    s.sortedIds[smaller] = own;
  }
  __syncthreads();
}

/// The same for lists longer than the block.
__device__ void sortInMemory(const std::uint32_t* from, std::uint32_t n, std::uint32_t* to,
                             Shared& s) {
  for (std::uint32_t first = 0; first < n; first += kThreads) {
    const std::uint32_t i = first + threadIdx.x;
    const std::uint32_t own = i < n ? from[i] : 0;
    std::uint32_t smaller = 0;
    for (std::uint32_t chunk = 0; chunk < n; chunk += kThreads) {
      __syncthreads();
      if (chunk + threadIdx.x < n) s.ids[threadIdx.x] = from[chunk + threadIdx.x];
      __syncthreads();
      const std::uint32_t count = min(n - chunk, std::uint32_t(kThreads));
      for (std::uint32_t j = 0; j < count; ++j) smaller += s.ids[j] < own ? 1 : 0;
    }
    if (i < n) to[smaller] = own;
  }
  __syncthreads();
}

/// Copies views with all threads, 16 bytes each.
__device__ void stageViews(const DrawArguments& a, Shared& s, const std::uint32_t* ids, int count) {
  constexpr int kWords = sizeof(PrimitiveView) / sizeof(float4);
  static_assert(kStage * kWords == kThreads);
  const int slot = int(threadIdx.x) / kWords, word = int(threadIdx.x) % kWords;
  if (slot < count)
    reinterpret_cast<float4*>(&s.views[slot])[word] =
        reinterpret_cast<const float4*>(&a.views[ids[slot]])[word];
}

__device__ void stagePlacement(const DrawArguments& a, Shared& s, const TileWork& work,
                               std::uint32_t id, int slot, double firstSample) {
  const PrimitiveView& view = a.views[id];
  const Footprint& f = a.footprints[id];
  s.placements[slot] = {float(work.firstColumn - view.column),
                        float(work.firstRow - view.row),
                        float(view.depth),
                        float(view.depth * work.middleUnit - firstSample),
                        f.firstColumn - work.firstColumn,
                        f.lastColumn - work.firstColumn,
                        f.firstRow - work.firstRow,
                        f.lastRow - work.firstRow};
}

/// The bits of samples first to last; none where last is before first.
__device__ std::uint32_t samplesFrom(int first, int last) {
  return last < first ? 0u : (0xffffffffu >> (kBinSamples - 1 - (last - first))) << first;
}

/// \return the samples of the thread's ray that something was added to
__device__ std::uint32_t addStaged(Shared& s, const Pixel& pixel, bool alive, int count) {
  const int lane = int(threadIdx.x) % kWarp;
  const bool near = lane < count && warpRectangle().meets(s.placements[lane]);
  float* const sums = &s.sums[threadIdx.x];
  std::uint32_t touched = 0;
  unsigned left = __ballot_sync(kAllLanes, near);
  if (__all_sync(kAllLanes, !alive)) return 0;
  for (; left != 0; left &= left - 1) {
    const int slot = __ffs(int(left)) - 1;
    if (!alive) continue;
    const RayForm& form = s.views[slot].form;
    const Placement& p = s.placements[slot];
    const RaySpan span = spanOn(form, p.dx + float(pixel.column), p.dy + float(pixel.row),
                                pixel.scale, p.depth, p.middleAhead);
    touched |= samplesFrom(span.first, span.last);
    for (int i = span.first; i <= span.last; ++i) sums[i * kThreads] += valueAt(form, span, i);
  }
  return touched;
}

/// Ids in shared memory, in order. \return the samples that something was added to
__device__ std::uint32_t addSorted(const DrawArguments& a, Shared& s, const TileWork& work,
                                   const Pixel& pixel, bool alive, const std::uint32_t* ids, int n,
                                   double firstSample) {
  std::uint32_t touched = 0;
  for (int first = 0; first < n; first += kStage) {
    const int count = min(n - first, kStage);
    stageViews(a, s, ids + first, count);
    if (int(threadIdx.x) < count)
      stagePlacement(a, s, work, ids[first + threadIdx.x], int(threadIdx.x), firstSample);
    __syncthreads();
    touched |= addStaged(s, pixel, alive, count);
    __syncthreads();  // the next stage overwrites this one
  }
  return touched;
}

/// All of a bin's list.
__device__ std::uint32_t addBin(const DrawArguments& a, Shared& s, const TileWork& work,
                                const Pixel& pixel, bool alive, std::size_t list, int bin) {
  const std::uint32_t n = a.lists.counts[list], begin = a.lists.ends[list] - n;
  const double firstSample = double(a.frame.firstBin + bin) * kBinSamples;
  if (n <= kThreads) {
    if (threadIdx.x < n) s.ids[threadIdx.x] = a.lists.entries[begin + threadIdx.x];
    __syncthreads();
    sortInShared(s, n);
    return addSorted(a, s, work, pixel, alive, s.sortedIds, int(n), firstSample);
  }
  std::uint32_t* const sorted = a.lists.sorted + begin;
  sortInMemory(a.lists.entries + begin, n, sorted, s);
  std::uint32_t touched = 0;
  for (std::uint32_t first = 0; first < n; first += kThreads) {
    const int count = int(min(n - first, std::uint32_t(kThreads)));
    touched |= addSorted(a, s, work, pixel, alive, sorted + first, count, firstSample);
  }
  return touched;
}

/// \param firstSample  of the bin, counted from the frame's first
__device__ void composite(const DrawArguments& a, Shared& s, const Pixel& pixel,
                          std::uint32_t touched, float firstSample, RayState& ray) {
  const float toEye = float(a.frame.firstBin) * kBinSamples;
  for (; touched != 0; touched &= touched - 1) {
    const int sample = __ffs(int(touched)) - 1;
    float& slot = s.sums[sample * kThreads + threadIdx.x];
    const float sum = slot, number = firstSample + float(sample);
    slot = 0.0f;
    const bool inside = number >= pixel.firstSample && number <= pixel.lastSample;
    if (sum != 0.0f && inside && a.rule.open(ray))
      a.rule.add(ray, a.rule.background + sum, toEye + number);
  }
}

/// The bins of a part, from front to back, until no ray of the tile shows what is behind.
__device__ RayState drawPart(const DrawArguments& a, Shared& s, const TilePart& item,
                             const TileWork& work, const Pixel& pixel) {
  RayState ray;
  const int first = int(item.part) * a.frame.binsOfPart;
  const int end = min(first + a.frame.binsOfPart, a.frame.bins);
  for (int bin = first; bin < end; ++bin) {
    const std::size_t list = std::size_t(item.tile) * a.frame.bins + bin;
    if (a.lists.counts[list] == 0) continue;
    const bool alive = pixel.inPicture && a.rule.open(ray);
    const std::uint32_t touched = addBin(a, s, work, pixel, alive, list, bin);
    composite(a, s, pixel, touched, float(bin * kBinSamples), ray);
    if (!__syncthreads_or(pixel.inPicture && a.rule.open(ray))) break;
  }
  return ray;
}

__device__ void writePixel(const DrawArguments& a, const TileWork& work, const Pixel& pixel,
                           const RayState& ray) {
  if (!pixel.inPicture) return;
  const int row = work.firstRow + pixel.row - a.frame.firstTileRow * kSide;
  const int column = work.firstColumn + pixel.column;
  const PixelColor c = a.rule.finished(ray);
  a.pixels[std::size_t(row) * a.frame.resolution.width + column] =
      make_float4(c.r, c.g, c.b, c.alpha);
}

__device__ RayState loadResult(const RayState* results, std::uint32_t result) {
  const float4 v = __ldcg(
      reinterpret_cast<const float4*>(&results[std::size_t(result) * kThreads + threadIdx.x]));
  return {v.x, v.y, v.z, v.w};
}

/// Whoever finishes a tile's last part puts them over each other.
__device__ void joinParts(const DrawArguments& a, const TilePart& item, const TileWork& work,
                          const Pixel& pixel) {
  const std::uint32_t* const resultOf = &a.lists.resultOf[std::size_t(item.tile) * a.frame.parts];
  RayState ray;
  for (int part = 0; part < a.frame.parts && a.rule.open(ray); ++part)
    if (resultOf[part] != kNoResult) a.rule.join(ray, loadResult(a.lists.results, resultOf[part]));
  writePixel(a, work, pixel, ray);
}

/// \return true in all threads where the other parts of the tile are done, and visible
__device__ bool storeResult(const DrawArguments& a, Shared& s, const TilePart& item,
                            const RayState& ray, const Pixel& pixel) {
  const std::uint32_t result = a.lists.resultOf[std::size_t(item.tile) * a.frame.parts + item.part];
  a.lists.results[std::size_t(result) * kThreads + threadIdx.x] = ray;
  const bool open = pixel.inPicture && a.rule.open(ray);
  __threadfence();
  const bool closed = !__syncthreads_or(open);
  if (threadIdx.x == 0) {
    if (closed) atomicMin(&a.lists.closedAt[item.tile], item.part);
    const std::uint32_t before = atomicAdd(&a.lists.partsDone[item.tile], 1u);
    s.isLast = before + 1 == a.lists.partsOfTile[item.tile] ? 1 : 0;
    __threadfence();
  }
  __syncthreads();
  return s.isLast != 0;
}

/// The next item of work, the longest lists first.
__device__ void takeItem(const DrawArguments& a, Shared& s) {
  FrameCounters& counters = *a.lists.counters;
  std::uint32_t n = atomicAdd(&counters.next, 1u);
  s.hasItem = 0;
  const std::size_t room = std::size_t(a.frame.tiles()) * a.frame.parts;
  for (int of = 0; of < DrawTuning::kLengthClasses; ++of) {
    if (n < counters.items[of]) {
      s.item = a.lists.items[of * room + n];
      s.hasItem = 1;
      return;
    }
    n -= counters.items[of];
  }
}

/// True where a part before this one lets nothing through.
__device__ bool isHidden(const DrawArguments& a, const TilePart& item) {
  return __ldcg(&a.lists.closedAt[item.tile]) < item.part;
}

__device__ void drawItem(const DrawArguments& a, Shared& s, const TilePart& item) {
  const TileWork work = workOf(a.frame, item.tile);
  Pixel pixel = pixelOf(a.frame, work);
  clipTo(a.clip, a.frame, work, pixel);
  if (a.lists.partsOfTile[item.tile] == 1)
    return writePixel(a, work, pixel, drawPart(a, s, item, work, pixel));
  const bool hidden = __syncthreads_or(threadIdx.x == 0 && isHidden(a, item));
  const RayState ray = hidden ? RayState{} : drawPart(a, s, item, work, pixel);
  if (storeResult(a, s, item, ray, pixel)) joinParts(a, item, work, pixel);
}

__global__ void __launch_bounds__(kThreads, DrawTuning::kBlocksPerMultiprocessor)
    drawKernel(const DrawArguments a) {
  __shared__ Shared s;
  if (!listsFit(*a.lists.counters, a.lists)) return;
  for (int i = 0; i < kBinSamples; ++i) s.sums[i * kThreads + threadIdx.x] = 0.0f;
  while (true) {
    if (threadIdx.x == 0) takeItem(a, s);
    __syncthreads();
    if (s.hasItem == 0) return;
    const TilePart item = s.item;
    __syncthreads();  // before the next item is written
    drawItem(a, s, item);
    __syncthreads();
  }
}

}  // namespace

void launchDraw(const DrawArguments& arguments, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = unsigned(multiprocessors * DrawTuning::kBlocksPerMultiprocessor);
  drawKernel<<<blocks, kThreads, 0, stream>>>(arguments);
  check(cudaGetLastError(), "drawing tiles");
}

}  // namespace esvr::cuda
