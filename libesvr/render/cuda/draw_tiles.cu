#include "core/cuda/check.h"
#include "render/cuda/tile_frame.h"

namespace esvr::cuda {
namespace {

constexpr int kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffu;
constexpr int kSide = DrawTuning::kTileSide, kRays = DrawTuning::kTilePixels;
constexpr int kGroups = DrawTuning::kGroups, kThreads = DrawTuning::kDrawThreads;
constexpr int kWarps = kThreads / kWarp, kHalves = kRays / kWarp;
constexpr int kStage = kWarp * kGroups;  // a lane of each warp looks at one staged ellipsoid
constexpr int kRowsOfHalf = kSide / kHalves;
static_assert(kRays == 64 && kGroups == 4, "sums and colors of a sample share their place");

/// An ellipsoid placed: from the tile's first pixel and the bin's first sample.
struct alignas(16) Staged {
  float dx, dy;
  float depth, middleAhead;
  std::uint32_t halves;  ///< bit h: it may cover pixels of half h of the tile
  std::uint32_t unused;
  RayForm form;
};
static_assert(sizeof(Staged) == sizeof(PrimitiveView) &&
                  offsetof(Staged, form) == offsetof(PrimitiveView, form),
              "staged in place of what was read");

struct Shared {
  /// Of a sample the partial sums of each group for all rays; then, in the same place, of each ray
  /// what the rule made of the whole sum. A warp's rays meet no bank twice.
  float sums[kBinSamples][kGroups][kRays];
  Staged staged[kStage];
  std::uint32_t ids[kThreads], sortedIds[kThreads];
  std::uint32_t openRays[kHalves];  ///< a bit a ray
  std::uint32_t touched;            ///< a bit a sample
  TilePart item;
  int hasItem;
  int isLast;
};

/// Threads of a group are a thread a ray, and the groups share the ellipsoids among them.
struct Place {
  int group, half, lane;
  int ray, column, row;

  __device__ Place() {
    const int warp = int(threadIdx.x) / kWarp;
    group = warp / kHalves, half = warp % kHalves, lane = int(threadIdx.x) % kWarp;
    ray = half * kWarp + lane, column = ray % kSide, row = ray / kSide;
  }
};

/// What a block knows of its tile, and a thread of its ray.
struct Work {
  int firstColumn, firstRow;  ///< pixels of the picture
  double middleUnit;          ///< samples for each unit along forward, on the tile's middle ray
  bool inPicture;
  RayScale scale;
  /// Samples that the clip box leaves, counted from the frame's first.
  float firstSample, lastSample;
};

__device__ void clipTo(const DrawArguments& a, const Place& place, Work& w) {
  w.firstSample = 0.0f, w.lastSample = float(a.frame.bins) * kBinSamples;
  if (!a.clip.given) return;
  const Ray ray = a.frame.view.ray(w.firstColumn + place.column, w.firstRow + place.row);
  const SampleRange range = samplesIn(ray, a.clip, a.frame.step);
  const double first = double(a.frame.firstBin) * kBinSamples;
  w.firstSample = float(range.first - first), w.lastSample = float(range.last - first);
}

__device__ Work workOf(const DrawArguments& a, std::uint32_t tile, const Place& place) {
  const TileFrame& frame = a.frame;
  const View& view = frame.view;
  Work w;
  w.firstColumn = int(tile) % frame.tileColumns * kSide;
  w.firstRow = (int(tile) / frame.tileColumns + frame.firstTileRow) * kSide;
  constexpr double kMiddle = (kSide - 1) / 2.0;
  w.middleUnit =
      view.unitAlong(view.planeX(w.firstColumn + kMiddle), view.planeY(w.firstRow + kMiddle)) /
      frame.step;
  const int column = w.firstColumn + place.column, row = w.firstRow + place.row;
  w.inPicture = column < frame.resolution.width && row < frame.resolution.height;
  const double unit = view.unitAlong(view.planeX(column), view.planeY(row)) / frame.step;
  w.scale = {float(unit), float(unit - w.middleUnit)};
  clipTo(a, place, w);
  return w;
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

__device__ std::uint32_t halvesOf(const Footprint& f, int firstRow) {
  static_assert(kHalves == 2);
  const bool upper = f.firstRow < firstRow + kRowsOfHalf,
             lower = f.lastRow >= firstRow + kRowsOfHalf;
  return (upper ? 1u : 0u) | (lower ? 2u : 0u);
}

/// Copies a view, 16 bytes a thread; the first two replace what only places it.
__device__ void stageOne(const DrawArguments& a, Shared& s, const Work& work, std::uint32_t id,
                         int slot, int word, double firstSample) {
  float4 v = reinterpret_cast<const float4*>(&a.views[id])[word];
  const int depthLow = __shfl_down_sync(kAllLanes, __float_as_int(v.x), 1);
  const int depthHigh = __shfl_down_sync(kAllLanes, __float_as_int(v.y), 1);
  if (word == 0) {
    const double column = __hiloint2double(__float_as_int(v.y), __float_as_int(v.x));
    const double row = __hiloint2double(__float_as_int(v.w), __float_as_int(v.z));
    const double depth = __hiloint2double(depthHigh, depthLow);
    v = make_float4(float(work.firstColumn - column), float(work.firstRow - row), float(depth),
                    float(depth * work.middleUnit - firstSample));
  }
  if (word == 1) v.x = __uint_as_float(halvesOf(a.footprints[id], work.firstRow));
  reinterpret_cast<float4*>(&s.staged[slot])[word] = v;
}

__device__ void stage(const DrawArguments& a, Shared& s, const Work& work, const std::uint32_t* ids,
                      int count, double firstSample) {
  constexpr int kWords = sizeof(Staged) / sizeof(float4);
  constexpr int kAtOnce = kThreads / kWords;
  const int word = int(threadIdx.x) % kWords;
  for (int first = 0; first < count; first += kAtOnce) {
    const int slot = first + int(threadIdx.x) / kWords;
    // All lanes take part in the exchange: those without an ellipsoid repeat the last.
    stageOne(a, s, work, ids[min(slot, count - 1)], min(slot, count - 1), word, firstSample);
  }
}

/// The bits of samples first to last; none where last is before first.
__device__ std::uint32_t samplesFrom(int first, int last) {
  return last < first ? 0u : (0xffffffffu >> (kBinSamples - 1 - (last - first))) << first;
}

/// \return the samples of the thread's ray that something was added to
__device__ std::uint32_t addOne(Shared& s, const Staged& e, const Place& place, const Work& work) {
  const RaySpan span = spanOn(e.form, e.dx + float(place.column), e.dy + float(place.row),
                              work.scale, e.depth, e.middleAhead);
  // Two at a time: the exponentials of one wait for nothing of the other.
  for (int i = span.first; i <= span.last; i += 2) {
    float* const sum = &s.sums[i][place.group][place.ray];
    const float first = valueAt(e.form, span, i), second = valueAt(e.form, span, i + 1);
    sum[0] += first;
    if (i < span.last) sum[kGroups * kRays] += second;
  }
  return samplesFrom(span.first, span.last);
}

/// The group's share of what is staged.
__device__ std::uint32_t addStaged(Shared& s, const Place& place, const Work& work, bool open,
                                   int count) {
  const int own = place.lane * kGroups + place.group;
  const bool near = own < count && (s.staged[own].halves >> place.half & 1u) != 0;
  unsigned left = __ballot_sync(kAllLanes, near);
  std::uint32_t touched = 0;
  for (; left != 0; left &= left - 1) {
    const int slot = (__ffs(int(left)) - 1) * kGroups + place.group;
    if (open) touched |= addOne(s, s.staged[slot], place, work);
  }
  return touched;
}

/// Ids in order.
__device__ std::uint32_t addSorted(const DrawArguments& a, Shared& s, const Place& place,
                                   const Work& work, bool open, const std::uint32_t* ids, int n,
                                   double firstSample) {
  std::uint32_t touched = 0;
  for (int first = 0; first < n; first += kStage) {
    const int count = min(n - first, kStage);
    stage(a, s, work, ids + first, count, firstSample);
    __syncthreads();
    touched |= addStaged(s, place, work, open, count);
    __syncthreads();  // the next stage overwrites this one
  }
  return touched;
}

/// Without __reduce_or_sync, which devices before sm_80 lack.
__device__ std::uint32_t orOfWarp(std::uint32_t bits) {
  for (int d = kWarp / 2; d > 0; d /= 2) bits |= __shfl_xor_sync(kAllLanes, bits, d);
  return bits;
}

/// All of a bin's list. Leaves the samples touched by any ray in s.touched.
__device__ void addBin(const DrawArguments& a, Shared& s, const Place& place, const Work& work,
                       std::size_t list, int bin) {
  const bool open = (s.openRays[place.half] >> place.lane & 1u) != 0;
  const std::uint32_t n = a.lists.counts[list], begin = a.lists.ends[list] - n;
  const double firstSample = double(a.frame.firstBin + bin) * kBinSamples;
  std::uint32_t touched = 0;
  if (n <= kThreads) {
    if (threadIdx.x < n) s.ids[threadIdx.x] = a.lists.entries[begin + threadIdx.x];
    __syncthreads();
    sortInShared(s, n);
    touched = addSorted(a, s, place, work, open, s.sortedIds, int(n), firstSample);
  } else {
    std::uint32_t* const sorted = a.lists.sorted + begin;
    sortInMemory(a.lists.entries + begin, n, sorted, s);
    touched = addSorted(a, s, place, work, open, sorted, int(n), firstSample);
  }
  touched = orOfWarp(touched);
  if (place.lane == 0 && touched != 0) atomicOr(&s.touched, touched);
  __syncthreads();
}

/// What the rule makes of each sum, by all threads: a warp takes whole samples, so that it alone
/// overwrites what it has read.
__device__ void classify(const DrawArguments& a, Shared& s) {
  const int warp = int(threadIdx.x) / kWarp, lane = int(threadIdx.x) % kWarp;
  for (int sample = warp; sample < kBinSamples; sample += kWarps) {
    if ((s.touched >> sample & 1u) == 0) continue;
    const auto& sums = s.sums[sample];
    PixelColor of[kHalves];
    for (int h = 0; h < kHalves; ++h) {
      const int ray = h * kWarp + lane;
      const float sum = (sums[0][ray] + sums[1][ray]) + (sums[2][ray] + sums[3][ray]);
      of[h] = sum != 0.0f ? a.rule.prepared(a.rule.background + sum) : PixelColor{0, 0, 0, 0};
    }
    __syncwarp();
    auto* const colors = reinterpret_cast<PixelColor*>(&s.sums[sample][0][0]);
    for (int h = 0; h < kHalves; ++h) colors[h * kWarp + lane] = of[h];
  }
  __syncthreads();
}

/// By the threads of the first group; leaves the sums zero.
__device__ void composite(const DrawArguments& a, Shared& s, const Place& place, const Work& work,
                          float firstSample, RayState& ray) {
  if (place.group == 0) {
    const float toEye = float(a.frame.firstBin) * kBinSamples;
    for (std::uint32_t left = s.touched; left != 0; left &= left - 1) {
      const int sample = __ffs(int(left)) - 1;
      PixelColor& color = reinterpret_cast<PixelColor*>(&s.sums[sample][0][0])[place.ray];
      const float number = firstSample + float(sample);
      if (number >= work.firstSample && number <= work.lastSample && a.rule.open(ray))
        a.rule.add(ray, color, toEye + number);
      color = {0.0f, 0.0f, 0.0f, 0.0f};
    }
    const unsigned open = __ballot_sync(kAllLanes, work.inPicture && a.rule.open(ray));
    if (place.lane == 0) s.openRays[place.half] = open;
  }
  __syncthreads();
  if (threadIdx.x == 0) s.touched = 0;
  __syncthreads();
}

__device__ bool anyOpen(const Shared& s) { return (s.openRays[0] | s.openRays[1]) != 0; }

/// The bins of a part, from front to back, until no ray of the tile shows what is behind. The
/// result is that of the first group's threads.
__device__ RayState drawPart(const DrawArguments& a, Shared& s, const TilePart& item,
                             const Place& place, const Work& work) {
  const unsigned inside = __ballot_sync(kAllLanes, work.inPicture);
  if (place.group == 0 && place.lane == 0) s.openRays[place.half] = inside;
  __syncthreads();
  RayState ray;
  const int first = int(item.part) * a.frame.binsOfPart;
  const int end = min(first + a.frame.binsOfPart, a.frame.bins);
  for (int bin = first; bin < end && anyOpen(s); ++bin) {
    const std::size_t list = std::size_t(item.tile) * a.frame.bins + bin;
    if (a.lists.counts[list] == 0) continue;
    addBin(a, s, place, work, list, bin);
    classify(a, s);
    composite(a, s, place, work, float(bin * kBinSamples), ray);
  }
  return ray;
}

__device__ void writePixel(const DrawArguments& a, const Place& place, const Work& work,
                           const RayState& ray) {
  if (!work.inPicture || place.group != 0) return;
  const int row = work.firstRow + place.row - a.frame.firstTileRow * kSide;
  const int column = work.firstColumn + place.column;
  const PixelColor c = a.rule.finished(ray);
  a.pixels[std::size_t(row) * a.frame.resolution.width + column] =
      make_float4(c.r, c.g, c.b, c.alpha);
}

__device__ RayState loadResult(const RayState* results, std::uint32_t result, int ray) {
  const float4 v = __ldcg(
      reinterpret_cast<const float4*>(&results[std::size_t(result) * kRays + std::size_t(ray)]));
  return {v.x, v.y, v.z, v.w};
}

/// Whoever finishes a tile's last part puts them over each other.
__device__ void joinParts(const DrawArguments& a, const TilePart& item, const Place& place,
                          const Work& work) {
  if (place.group != 0) return;
  const std::uint32_t* const resultOf = &a.lists.resultOf[std::size_t(item.tile) * a.frame.parts];
  RayState ray;
  for (int part = 0; part < a.frame.parts && a.rule.open(ray); ++part)
    if (resultOf[part] != kNoResult)
      a.rule.join(ray, loadResult(a.lists.results, resultOf[part], place.ray));
  writePixel(a, place, work, ray);
}

/// \return true in all threads where the other parts of the tile are done, and visible
__device__ bool storeResult(const DrawArguments& a, Shared& s, const TilePart& item,
                            const Place& place, const RayState& ray) {
  const std::uint32_t result = a.lists.resultOf[std::size_t(item.tile) * a.frame.parts + item.part];
  if (place.group == 0) a.lists.results[std::size_t(result) * kRays + std::size_t(place.ray)] = ray;
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) {
    if (!anyOpen(s)) atomicMin(&a.lists.closedAt[item.tile], item.part);
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

/// True where a part before this one lets nothing through: then this one shows nowhere.
__device__ bool isHidden(const DrawArguments& a, const TilePart& item) {
  return __ldcg(&a.lists.closedAt[item.tile]) < item.part;
}

__device__ void drawItem(const DrawArguments& a, Shared& s, const TilePart& item,
                         const Place& place) {
  const Work work = workOf(a, item.tile, place);
  if (a.lists.partsOfTile[item.tile] == 1)
    return writePixel(a, place, work, drawPart(a, s, item, place, work));
  const bool hidden = __syncthreads_or(threadIdx.x == 0 && isHidden(a, item));
  if (hidden && threadIdx.x < kHalves) s.openRays[threadIdx.x] = 1;
  const RayState ray = hidden ? RayState{} : drawPart(a, s, item, place, work);
  if (storeResult(a, s, item, place, ray)) joinParts(a, item, place, work);
}

__global__ void __launch_bounds__(kThreads, DrawTuning::kBlocksPerMultiprocessor)
    drawKernel(const DrawArguments a) {
  extern __shared__ float4 memory[];
  Shared& s = *reinterpret_cast<Shared*>(memory);
  if (!listsFit(*a.lists.counters, a.lists)) return;
  const Place place;
  for (int i = int(threadIdx.x); i < kBinSamples * kThreads; i += kThreads)
    (&s.sums[0][0][0])[i] = 0.0f;
  if (threadIdx.x == 0) s.touched = 0;
  while (true) {
    if (threadIdx.x == 0) takeItem(a, s);
    __syncthreads();
    if (s.hasItem == 0) return;
    const TilePart item = s.item;
    __syncthreads();  // before the next item is written
    drawItem(a, s, item, place);
    __syncthreads();
  }
}

}  // namespace

void launchDraw(const DrawArguments& arguments, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = unsigned(multiprocessors * DrawTuning::kBlocksPerMultiprocessor);
  check(cudaFuncSetAttribute(drawKernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                             int(sizeof(Shared))),
        "asking for shared memory");
  drawKernel<<<blocks, kThreads, sizeof(Shared), stream>>>(arguments);
  check(cudaGetLastError(), "drawing tiles");
}

}  // namespace esvr::cuda
