#include "render/cuda/draw_work.cuh"

namespace esvr::cuda {
namespace {

constexpr int kStage = kWarp * kGroups;  // ellipsoids staged at once: one for each lane and group
constexpr int kRowsOfHalf = kSide / kHalves;

/// An ellipsoid in shared memory, relative to the tile's first pixel and the bin's first sample.
/// The members are those that spanOn() (ray_math.h) takes.
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
struct Shared : WorkShared {
  /// Partial sums of each sample, by group and ray. The rays of a warp lie next to each other, so
  /// its accesses have no bank conflicts.
  float sums[kBinSamples][kGroups][kRays];
  union {
    Staged staged[kStage];  ///< while ellipsoids are added
    BehindShares behind;    ///< while samples are composited
  };
  std::uint32_t ids[kThreads], sortedIds[kThreads];
  std::uint32_t touched;  ///< bit i is set if an ellipsoid was added to sample i of any ray
};

/// The data of a thread's ray, in addition to Work.
struct SumWork : Work {
  double middleUnit;  ///< samples per unit of depth along forward, on the tile's middle ray
  RayScale scale;
};

__device__ SumWork sumWorkOf(const SumArguments& a, std::uint32_t tile, const Place& place) {
  const TileFrame& frame = a.draw.frame;
  const View& view = frame.view;
  SumWork w;
  static_cast<Work&>(w) = workOf(a.draw, tile, place);
  constexpr double kMiddle = (kSide - 1) / 2.0;
  w.middleUnit =
      view.unitAlong(view.planeX(w.firstColumn + kMiddle), view.planeY(w.firstRow + kMiddle)) /
      frame.step;
  const int column = w.firstColumn + place.column, row = w.firstRow + place.row;
  const double unit = view.unitAlong(view.planeX(column), view.planeY(row)) / frame.step;
  w.scale = {float(unit), float(unit - w.middleUnit)};
  return w;
}

/// Sorts up to kThreads ids, because float sums depend on the order of their terms and lists are
/// filled in any order. The place of an id is the number of smaller ids.
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

/// Sorts a list of any length in the same way, from global memory to global memory.
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

/// Copies one 16-byte word of an EllipsoidView into shared memory. The threads of words 0 and 1
/// replace the ellipsoid's position in the picture by its position relative to tile and bin.
__device__ void stageOne(const SumArguments& a, Shared& s, const SumWork& work, std::uint32_t id,
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

__device__ void stage(const SumArguments& a, Shared& s, const SumWork& work,
                      const std::uint32_t* ids, int count, double firstSample) {
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
__device__ std::uint32_t addOne(Shared& s, const Staged& e, const Place& place,
                                const SumWork& work) {
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
__device__ std::uint32_t addStaged(Shared& s, const Place& place, const SumWork& work, bool open,
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
                                   const SumWork& work, bool open, const std::uint32_t* ids, int n,
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
__device__ void addBin(const SumArguments& a, Shared& s, const Place& place, const SumWork& work,
                       std::size_t list, int bin) {
  const bool open = isOpen(s, place);
  const std::uint32_t n = a.draw.lists.counts[list], begin = a.draw.lists.ends[list] - n;
  const double firstSample = double(a.draw.frame.firstBin + bin) * kBinSamples;
  std::uint32_t touched = 0;
  if (n <= kThreads) {
    if (threadIdx.x < n) s.ids[threadIdx.x] = a.draw.lists.entries[begin + threadIdx.x];
    __syncthreads();
    sortInShared(s, n);
    touched = addSorted(a, s, place, work, open, s.sortedIds, int(n), firstSample);
  } else {
    std::uint32_t* const sorted = a.draw.lists.sorted + begin;
    sortInMemory(a.draw.lists.entries + begin, n, sorted, s);
    touched = addSorted(a, s, place, work, open, sorted, int(n), firstSample);
  }
  touched = warpOr(touched);
  if (place.lane == 0 && touched != 0) atomicOr(&s.touched, touched);
  __syncthreads();
}

/// The sum of a sample on a ray. It is set to 0 for the next bin.
__device__ float takeSum(Shared& s, int sample, int ray) {
  float sum = 0.0f;
  for (int g = 0; g < kGroups; ++g) {
    sum += s.sums[sample][g][ray];
    s.sums[sample][g][ray] = 0.0f;
  }
  return sum;
}

/// Adds a share of a bin's samples to a ray.
__device__ void addSamples(const SamplingArguments& a, Shared& s, const Place& place,
                           const SumWork& work, int bin, const Share& share, RayState& ray) {
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

/// Composites the samples of a bin. All rays take part, because their sums are set to 0; a ray that
/// is closed has sums of 0 only.
__device__ void drawSamples(const SamplingArguments& a, Shared& s, const Place& place,
                            const SumWork& work, int bin, RayState& ray) {
  addInShares(
      a.rule, s, s.behind, place, work, true, kBinSamples, ray,
      [&](const Share& share, RayState& part) { addSamples(a, s, place, work, bin, share, part); });
  if (threadIdx.x == 0) s.touched = 0;
  __syncthreads();
}

__global__ void __launch_bounds__(kThreads, DrawTuning::kBlocksPerMultiprocessor)
    drawSumsKernel(const SumArguments a) {
  extern __shared__ float4 memory[];
  Shared& s = *reinterpret_cast<Shared*>(memory);
  if (!listsFit(*a.draw.lists.counters, a.draw.lists)) return;
  const Place place;
  for (int i = int(threadIdx.x); i < kBinSamples * kThreads; i += kThreads)
    (&s.sums[0][0][0])[i] = 0.0f;
  if (threadIdx.x == 0) s.touched = 0;
  forEachItem(a.draw, s, [&](const TilePart& item) {
    const SumWork work = sumWorkOf(a, item.tile, place);
    drawItem(a.draw, s, item, place, work, [&](std::size_t list, int bin, RayState& ray) {
      addBin(a, s, place, work, list, bin);
      drawSamples(a.draw, s, place, work, bin, ray);
    });
  });
}

}  // namespace

void launchDrawSums(const SumArguments& arguments, int multiprocessors, cudaStream_t stream) {
  launchOverTiles(drawSumsKernel, arguments, sizeof(Shared),
                  multiprocessors * DrawTuning::kBlocksPerMultiprocessor, stream);
}

}  // namespace esvr::cuda
