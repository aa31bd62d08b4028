// Draws the lists of a picture of a sum of ellipsoids, by per-ellipsoid ray sampling (paper,
// algorithm 2). A block of threads takes a part of a tile (all of its depth, or a range of it) from
// a queue and draws its bins from front to back. The block that finishes the last part of a tile
// composites the parts.
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "render/cuda/sum_frame.h"

namespace esvr::cuda {
namespace {

// The threads of a block, and what they share.

constexpr int kTileSide = DrawTuning::kTileSide, kRays = DrawTuning::kTilePixels;
constexpr int kGroups = DrawTuning::kGroups, kThreads = DrawTuning::kDrawThreads;
constexpr int kHalves = kRays / kWarp, kRowsOfHalf = kTileSide / kHalves;
constexpr int kStage = kWarp * kGroups;  // ellipsoids staged at once: one for each lane and group
static_assert(kRays == 64, "two halves of a tile");

/// The place of a thread in its block. A group has one thread for each ray of the tile, and each
/// half of a tile's rays is one warp of the group.
struct Place {
  int group, half, lane;
  int ray, column, row;

  __device__ Place() {
    const int warp = int(threadIdx.x) / kWarp;
    group = warp / kHalves, half = warp % kHalves, lane = int(threadIdx.x) % kWarp;
    ray = half * kWarp + lane, column = ray % kTileSide, row = ray / kTileSide;
  }
};

/// An ellipsoid in shared memory, relative to the tile's first pixel and the bin's first sample.
/// The members are those that spanOn() takes.
struct alignas(16) Staged {
  float dx, dy;
  float depth, middleAhead;
  std::uint32_t halves;  ///< bit h is set if the ellipsoid may cover pixels of half h of the tile
  std::uint32_t unused;
  RayForm form;
};
static_assert(sizeof(Staged) == sizeof(EllipsoidView) &&
                  offsetof(Staged, form) == offsetof(EllipsoidView, form),
              "staged in place of what was read");

/// Shared memory of a block. Each group of threads adds its share of a list's ellipsoids.
struct Shared {
  std::uint32_t openRays[kHalves];  ///< a bit for each ray, set while more samples can change it
  TilePart item;
  int hasItem;
  int isLast;
  /// Partial sums of each sample, by group and ray. The rays of a warp lie next to each other, so
  /// its accesses have no bank conflicts.
  float sums[kBinSamples][kGroups][kRays];
  union {
    Staged staged[kStage];  ///< while ellipsoids are added
    /// While samples are composited: the samples of a ray that each group but the first has
    /// gathered.
    RayState behind[kGroups - 1][kRays];
  };
  std::uint32_t ids[kThreads], sortedIds[kThreads];
  std::uint32_t touched;  ///< bit i is set if an ellipsoid was added to sample i of any ray
};

/// The data of a thread's tile and ray.
struct Work {
  int firstColumn, firstRow;  ///< pixels of the picture
  bool inPicture;
  /// Range of the samples inside the clip box, counted from the frame's first sample.
  float firstSample, lastSample;
  double middleUnit;  ///< samples per unit of depth along forward, on the tile's middle ray
  RayScale scale;
};

__device__ Work workOf(const SumArguments& a, std::uint32_t tile, const Place& place) {
  const TileFrame& frame = a.frame;
  const View& view = frame.view;
  Work w;
  w.firstColumn = int(tile) % frame.tileColumns * kTileSide;
  w.firstRow = (int(tile) / frame.tileColumns + frame.firstTileRow) * kTileSide;
  const int column = w.firstColumn + place.column, row = w.firstRow + place.row;
  w.inPicture = column < frame.resolution.width && row < frame.resolution.height;
  w.firstSample = 0.0f, w.lastSample = float(frame.bins) * kBinSamples;
  if (a.clip.given) {
    const SampleRange range = samplesIn(view.ray(column, row), a.clip, frame.step);
    const double first = double(frame.firstBin) * kBinSamples;
    w.firstSample = float(range.first - first), w.lastSample = float(range.last - first);
  }
  constexpr double kMiddle = (kTileSide - 1) / 2.0;
  w.middleUnit =
      view.unitAlong(view.planeX(w.firstColumn + kMiddle), view.planeY(w.firstRow + kMiddle)) /
      frame.step;
  const double unit = view.unitAlong(view.planeX(column), view.planeY(row)) / frame.step;
  w.scale = {float(unit), float(unit - w.middleUnit)};
  return w;
}

__device__ bool isOpen(const Shared& s, const Place& place) {
  return (s.openRays[place.half] >> place.lane & 1u) != 0;
}
__device__ bool anyOpen(const Shared& s) { return (s.openRays[0] | s.openRays[1]) != 0; }

// The ellipsoids of a bin are sorted, because float sums depend on the order of their terms and
// lists are filled in any order.

/// Sorts up to kThreads ids. The place of an id is the number of smaller ids.
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

/// Sorts a list of any length, from global memory to global memory.
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

// The sums of a bin.

__device__ std::uint32_t halvesOf(const Footprint& f, int firstRow) {
  static_assert(kHalves == 2);
  const bool upper = f.firstRow < firstRow + kRowsOfHalf,
             lower = f.lastRow >= firstRow + kRowsOfHalf;
  return (upper ? 1u : 0u) | (lower ? 2u : 0u);
}

/// Copies one 16-byte word of an EllipsoidView into shared memory. The threads of words 0 and 1
/// replace the ellipsoid's position in the picture by its position relative to tile and bin.
__device__ void stageOne(const SumArguments& a, Shared& s, const Work& work, std::uint32_t id,
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

__device__ void stage(const SumArguments& a, Shared& s, const Work& work, const std::uint32_t* ids,
                      int count, double firstSample) {
  constexpr int kWords = sizeof(Staged) / sizeof(float4);
  constexpr int kAtOnce = kThreads / kWords;
  const int word = int(threadIdx.x) % kWords;
  for (int first = 0; first < count; first += kAtOnce) {
    const int slot = first + int(threadIdx.x) / kWords;
    // All lanes of a warp must take part in its shuffles, so those without an ellipsoid copy the
    // last one again.
    stageOne(a, s, work, ids[min(slot, count - 1)], min(slot, count - 1), word, firstSample);
  }
}

/// Sets the bits of the samples first to last; no bit if last < first.
__device__ std::uint32_t samplesFrom(int first, int last) {
  return last < first ? 0u : (0xffffffffu >> (kBinSamples - 1 - (last - first))) << first;
}

/// Adds an ellipsoid to the thread's ray. \return a bit for each sample that it was added to
__device__ std::uint32_t addOne(Shared& s, const Staged& e, const Place& place, const Work& work) {
  const RaySpan span = spanOn(e.form, e.dx + float(place.column), e.dy + float(place.row),
                              work.scale, e.depth, e.middleAhead);
  // Two samples at a time: their exponentials do not depend on each other and can overlap.
  for (int i = span.first; i <= span.last; i += 2) {
    float* const sum = &s.sums[i][place.group][place.ray];
    const float first = valueAt(e.form, span, i), second = valueAt(e.form, span, i + 1);
    sum[0] += first;
    if (i < span.last) sum[kGroups * kRays] += second;
  }
  return samplesFrom(span.first, span.last);
}

/// Adds the group's share of the staged ellipsoids: every kGroups-th one.
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

/// Adds the ellipsoids of a sorted list, kStage at a time.
__device__ std::uint32_t addSorted(const SumArguments& a, Shared& s, const Place& place,
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

/// All of a bin's list. Leaves the samples touched by any ray in s.touched.
__device__ void addBin(const SumArguments& a, Shared& s, const Place& place, const Work& work,
                       std::size_t list, int bin) {
  const bool open = isOpen(s, place);
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
  touched = warpOr(touched);
  if (place.lane == 0 && touched != 0) atomicOr(&s.touched, touched);
  __syncthreads();
}

// The samples of a bin are composited.

/// The sum of a sample on a ray. It is set to 0 for the next bin.
__device__ float takeSum(Shared& s, int sample, int ray) {
  float sum = 0.0f;
  for (int g = 0; g < kGroups; ++g) {
    sum += s.sums[sample][g][ray];
    s.sums[sample][g][ray] = 0.0f;
  }
  return sum;
}

/// The samples of a ray that one thread takes.
struct Share {
  int first, end;
};
/// The groups divide the samples of a ray among them. In RenderMode::kDepth the first group takes
/// all, because that mode must stop at a sample that depends on all samples before it.
__device__ Share shareOf(const SampleRule& rule, const Place& place, int samples) {
  if (rule.mode == RenderMode::kDepth) return {0, place.group == 0 ? samples : 0};
  const int each = (samples + kGroups - 1) / kGroups, first = min(place.group * each, samples);
  return {first, min(first + each, samples)};
}

/// Adds a share of a bin's samples to a ray.
__device__ void addSamples(const SumArguments& a, Shared& s, const Place& place, const Work& work,
                           int bin, const Share& share, RayState& ray) {
  const float toEye =
      float(double(a.frame.firstBin) * kBinSamples + a.frame.view.before / a.frame.step);
  std::uint32_t left = s.touched & samplesFrom(share.first, share.end - 1);
  for (; left != 0; left &= left - 1) {
    const int sample = __ffs(int(left)) - 1;
    const float sum = takeSum(s, sample, place.ray);
    const float value = a.voxelRule.settled(a.rule.background + sum);
    const std::uint32_t index = std::uint32_t(bin * kBinSamples + sample);
    const float number = float(index);
    if (sum != 0.0f && value != a.rule.background && number >= work.firstSample &&
        number <= work.lastSample && a.rule.open(ray))
      a.rule.add(ray, value, {toEye + number, index});
  }
}

/// Composites the samples of a bin. Each group takes the samples behind those of the group before
/// it; the first group then joins their results from front to back, and updates s.openRays. All
/// rays take part, because their sums are set to 0; a ray that is closed has sums of 0 only.
/// \param ray  counts in the first group's threads
__device__ void drawSamples(const SumArguments& a, Shared& s, const Place& place, const Work& work,
                            int bin, RayState& ray) {
  const SampleRule& rule = a.rule;
  RayState part = place.group == 0 ? ray : RayState::behind();
  addSamples(a, s, place, work, bin, shareOf(rule, place, kBinSamples), part);
  if (place.group == 0)
    ray = part;
  else
    s.behind[place.group - 1][place.ray] = part;
  __syncthreads();
  if (place.group == 0) {
    if (rule.mode != RenderMode::kDepth)
      for (int g = 0; g < kGroups - 1 && rule.open(ray); ++g)
        rule.join(ray, s.behind[g][place.ray]);
    const unsigned open = __ballot_sync(kAllLanes, work.inPicture && rule.open(ray));
    if (place.lane == 0) s.openRays[place.half] = open;
  }
  if (threadIdx.x == 0) s.touched = 0;
  __syncthreads();
}

/// Draws the bins of a part from front to back, and stops when all rays of the tile are closed.
/// Only the threads of the first group return a result.
/// \param ray  the ray before its first sample
__device__ RayState drawPart(const SumArguments& a, Shared& s, const TilePart& item,
                             const Place& place, const Work& work, RayState ray) {
  const unsigned inside = __ballot_sync(kAllLanes, work.inPicture);
  if (place.group == 0 && place.lane == 0) s.openRays[place.half] = inside;
  __syncthreads();
  const int first = int(item.part) * a.frame.binsOfPart;
  const int end = min(first + a.frame.binsOfPart, a.frame.bins);
  for (int bin = first; bin < end && anyOpen(s); ++bin) {
    const std::size_t list = std::size_t(item.tile) * a.frame.bins + bin;
    if (a.lists.counts[list] == 0) continue;
    addBin(a, s, place, work, list, bin);
    drawSamples(a, s, place, work, bin, ray);
  }
  return ray;
}

// Pixels, and the parts of a tile.

__device__ void writePixel(const SumArguments& a, const Place& place, const Work& work,
                           const RayState& ray) {
  if (!work.inPicture || place.group != 0) return;
  const int row = work.firstRow + place.row - a.frame.firstTileRow * kTileSide;
  const int column = work.firstColumn + place.column;
  const PixelColor c = a.rule.finished(ray);
  a.pixels[std::size_t(row) * a.frame.resolution.width + column] =
      make_float4(c.r, c.g, c.b, c.alpha);
}

__device__ RayState loadResult(const RayState* results, std::uint32_t result, int ray) {
  static_assert(sizeof(RayState) == 2 * sizeof(float4));
  const auto* const from =
      reinterpret_cast<const float4*>(&results[std::size_t(result) * kRays + std::size_t(ray)]);
  RayState state;
  auto* const to = reinterpret_cast<float4*>(&state);
  to[0] = __ldcg(from), to[1] = __ldcg(from + 1);
  return state;
}

/// Composites the parts of a tile. The block that finished the last of them calls it.
__device__ void joinParts(const SumArguments& a, const TilePart& item, const Place& place,
                          const Work& work) {
  if (place.group != 0) return;
  const std::uint32_t* const resultOf = &a.lists.resultOf[std::size_t(item.tile) * a.frame.parts];
  RayState ray;
  for (int part = 0; part < a.frame.parts && a.rule.open(ray); ++part)
    if (resultOf[part] != kNoResult)
      a.rule.join(ray, loadResult(a.lists.results, resultOf[part], place.ray));
  writePixel(a, place, work, ray);
}

/// Stores the result of a part. \return true, in all threads of the block, if all other parts of
/// the tile are done; their results can then be read
__device__ bool storeResult(const SumArguments& a, Shared& s, const TilePart& item,
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

/// True if a part in front of this one is opaque on all rays, so that this one cannot be seen.
__device__ bool isHidden(const SumArguments& a, const TilePart& item) {
  return __ldcg(&a.lists.closedAt[item.tile]) < item.part;
}

__device__ void drawItem(const SumArguments& a, Shared& s, const TilePart& item,
                         const Place& place) {
  const Work work = workOf(a, item.tile, place);
  if (a.lists.partsOfTile[item.tile] == 1)
    return writePixel(a, place, work, drawPart(a, s, item, place, work, {}));
  const bool hidden = __syncthreads_or(threadIdx.x == 0 && isHidden(a, item));
  if (hidden && threadIdx.x < kHalves) s.openRays[threadIdx.x] = 1;
  const RayState none = RayState::behind();
  const RayState ray = hidden ? none : drawPart(a, s, item, place, work, none);
  if (storeResult(a, s, item, place, ray)) joinParts(a, item, place, work);
}

// The queue.

/// Takes the next item from the queue, which begins with the longest lists.
__device__ void takeItem(const SumArguments& a, Shared& s) {
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

__global__ void __launch_bounds__(kThreads, DrawTuning::kBlocksPerMultiprocessor)
    drawSumsKernel(const SumArguments a) {
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
    __syncthreads();  // all threads must have copied the item before the next one is written
    drawItem(a, s, item, place);
    __syncthreads();
  }
}

}  // namespace

void launchDrawSums(const SumArguments& arguments, int multiprocessors, cudaStream_t stream) {
  check(cudaFuncSetAttribute(drawSumsKernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                             int(sizeof(Shared))),
        "asking for shared memory");
  const int blocks = multiprocessors * DrawTuning::kBlocksPerMultiprocessor;
  drawSumsKernel<<<unsigned(blocks), kThreads, sizeof(Shared), stream>>>(arguments);
  check(cudaGetLastError(), "drawing tiles");
}

}  // namespace esvr::cuda
