#pragma once
/// How blocks of threads go through the tiles of a picture: parts of tiles come from a queue, their
/// bins are drawn from front to back, and whoever finishes a tile's last part puts its parts over
/// each other. What a bin's samples are is the caller's.

#include "core/cuda/reduce.cuh"
#include "render/cuda/tile_frame.h"

namespace esvr::cuda {

inline constexpr int kSide = DrawTuning::kTileSide, kRays = DrawTuning::kTilePixels;
inline constexpr int kGroups = DrawTuning::kGroups, kThreads = DrawTuning::kDrawThreads;
inline constexpr int kWarps = kThreads / kWarp, kHalves = kRays / kWarp;
static_assert(kRays == 64, "two halves of a tile");

/// The state that a block's threads share while they go through the work.
struct WorkShared {
  std::uint32_t openRays[kHalves];  ///< a bit a ray
  TilePart item;
  int hasItem;
  int isLast;
};

/// Threads of a group are a thread a ray.
struct Place {
  int group, half, lane;
  int ray, column, row;

  __device__ Place() {
    const int warp = int(threadIdx.x) / kWarp;
    group = warp / kHalves, half = warp % kHalves, lane = int(threadIdx.x) % kWarp;
    ray = half * kWarp + lane, column = ray % kSide, row = ray / kSide;
  }
};

/// A thread's knowledge of its tile and of its ray.
struct Work {
  int firstColumn, firstRow;  ///< pixels of the picture
  bool inPicture;
  /// Samples that the clip box leaves, counted from the frame's first.
  float firstSample, lastSample;
};

__device__ inline void clipTo(const SamplingArguments& a, const Place& place, Work& w) {
  w.firstSample = 0.0f, w.lastSample = float(a.frame.bins) * kBinSamples;
  if (!a.clip.given) return;
  const Ray ray = a.frame.view.ray(w.firstColumn + place.column, w.firstRow + place.row);
  const SampleRange range = samplesIn(ray, a.clip, a.frame.step);
  const double first = double(a.frame.firstBin) * kBinSamples;
  w.firstSample = float(range.first - first), w.lastSample = float(range.last - first);
}

__device__ inline Work workOf(const SamplingArguments& a, std::uint32_t tile, const Place& place) {
  const TileFrame& frame = a.frame;
  Work w;
  w.firstColumn = int(tile) % frame.tileColumns * kSide;
  w.firstRow = (int(tile) / frame.tileColumns + frame.firstTileRow) * kSide;
  const int column = w.firstColumn + place.column, row = w.firstRow + place.row;
  w.inPicture = column < frame.resolution.width && row < frame.resolution.height;
  clipTo(a, place, w);
  return w;
}

__device__ inline bool isOpen(const WorkShared& s, const Place& place) {
  return (s.openRays[place.half] >> place.lane & 1u) != 0;
}
__device__ inline bool anyOpen(const WorkShared& s) { return (s.openRays[0] | s.openRays[1]) != 0; }

__device__ inline void writePixel(const SamplingArguments& a, const Place& place, const Work& work,
                                  const RayState& ray) {
  if (!work.inPicture || place.group != 0) return;
  const int row = work.firstRow + place.row - a.frame.firstTileRow * kSide;
  const int column = work.firstColumn + place.column;
  const PixelColor c = a.rule.finished(ray);
  a.pixels[std::size_t(row) * a.frame.resolution.width + column] =
      make_float4(c.r, c.g, c.b, c.alpha);
}

__device__ inline RayState loadResult(const RayState* results, std::uint32_t result, int ray) {
  const float4 v = __ldcg(
      reinterpret_cast<const float4*>(&results[std::size_t(result) * kRays + std::size_t(ray)]));
  return {v.x, v.y, v.z, v.w};
}

/// Whoever finishes a tile's last part puts them over each other.
__device__ inline void joinParts(const SamplingArguments& a, const TilePart& item,
                                 const Place& place, const Work& work) {
  if (place.group != 0) return;
  const std::uint32_t* const resultOf = &a.lists.resultOf[std::size_t(item.tile) * a.frame.parts];
  RayState ray;
  for (int part = 0; part < a.frame.parts && a.rule.open(ray); ++part)
    if (resultOf[part] != kNoResult)
      a.rule.join(ray, loadResult(a.lists.results, resultOf[part], place.ray));
  writePixel(a, place, work, ray);
}

/// \return true in all threads where the other parts of the tile are done, and visible
__device__ inline bool storeResult(const SamplingArguments& a, WorkShared& s, const TilePart& item,
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
__device__ inline void takeItem(const SamplingArguments& a, WorkShared& s) {
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
__device__ inline bool isHidden(const SamplingArguments& a, const TilePart& item) {
  return __ldcg(&a.lists.closedAt[item.tile]) < item.part;
}

/// The bins of a part, from front to back, until no ray of the tile shows what is behind. The
/// result is that of the first group's threads.
/// \param drawBin  (list, bin, ray): adds a bin's samples to the ray, and tells s.openRays which
///                 rays are still open
template <class DrawBin>
__device__ RayState drawPart(const SamplingArguments& a, WorkShared& s, const TilePart& item,
                             const Place& place, const Work& work, DrawBin&& drawBin) {
  const unsigned inside = __ballot_sync(kAllLanes, work.inPicture);
  if (place.group == 0 && place.lane == 0) s.openRays[place.half] = inside;
  __syncthreads();
  RayState ray;
  const int first = int(item.part) * a.frame.binsOfPart;
  const int end = min(first + a.frame.binsOfPart, a.frame.bins);
  for (int bin = first; bin < end && anyOpen(s); ++bin) {
    const std::size_t list = std::size_t(item.tile) * a.frame.bins + bin;
    if (a.lists.counts[list] != 0) drawBin(list, bin, ray);
  }
  return ray;
}

template <class DrawBin>
__device__ void drawItem(const SamplingArguments& a, WorkShared& s, const TilePart& item,
                         const Place& place, const Work& work, DrawBin&& drawBin) {
  if (a.lists.partsOfTile[item.tile] == 1)
    return writePixel(a, place, work, drawPart(a, s, item, place, work, drawBin));
  const bool hidden = __syncthreads_or(threadIdx.x == 0 && isHidden(a, item));
  if (hidden && threadIdx.x < kHalves) s.openRays[threadIdx.x] = 1;
  const RayState ray = hidden ? RayState{} : drawPart(a, s, item, place, work, drawBin);
  if (storeResult(a, s, item, place, ray)) joinParts(a, item, place, work);
}

/// Calls draw(item) for items until there are none.
template <class Draw>
__device__ void forEachItem(const SamplingArguments& a, WorkShared& s, Draw&& draw) {
  while (true) {
    if (threadIdx.x == 0) takeItem(a, s);
    __syncthreads();
    if (s.hasItem == 0) return;
    const TilePart item = s.item;
    __syncthreads();  // before the next item is written
    draw(item);
    __syncthreads();
  }
}

/// Starts a kernel with as many blocks as run at once. \param bytes  of shared memory a block
template <class Arguments>
void launchOverTiles(void (*kernel)(Arguments), const Arguments& arguments, std::size_t bytes,
                     int blocks, cudaStream_t stream) {
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, int(bytes)),
        "asking for shared memory");
  kernel<<<unsigned(blocks), kThreads, bytes, stream>>>(arguments);
  check(cudaGetLastError(), "drawing tiles");
}

}  // namespace esvr::cuda
