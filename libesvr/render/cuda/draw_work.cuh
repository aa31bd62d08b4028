#pragma once
/// Distributes the work of a picture over blocks of threads. A block takes a part of a tile (all of
/// its depth, or a range of it) from a queue and draws its bins from front to back. The block that
/// finishes the last part of a tile composites the parts. The caller supplies the function that
/// draws a bin.

#include "core/cuda/reduce.cuh"
#include "render/cuda/tile_frame.h"

namespace esvr::cuda {

inline constexpr int kSide = DrawTuning::kTileSide, kRays = DrawTuning::kTilePixels;
inline constexpr int kGroups = DrawTuning::kGroups, kThreads = DrawTuning::kDrawThreads;
inline constexpr int kWarps = kThreads / kWarp, kHalves = kRays / kWarp;
static_assert(kRays == 64, "two halves of a tile");

/// The state that a block's threads share while they go through the work.
struct WorkShared {
  std::uint32_t openRays[kHalves];  ///< a bit for each ray, set while more samples can change it
  TilePart item;
  int hasItem;
  int isLast;
};

/// The place of a thread in its block. A group has one thread for each ray of the tile, and each
/// half of a tile's rays is one warp of the group.
struct Place {
  int group, half, lane;
  int ray, column, row;

  __device__ Place() {
    const int warp = int(threadIdx.x) / kWarp;
    group = warp / kHalves, half = warp % kHalves, lane = int(threadIdx.x) % kWarp;
    ray = half * kWarp + lane, column = ray % kSide, row = ray / kSide;
  }
};

/// The data of a thread's tile and ray.
struct Work {
  int firstColumn, firstRow;  ///< pixels of the picture
  bool inPicture;
  /// Range of the samples inside the clip box, counted from the frame's first sample.
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
  static_assert(sizeof(RayState) == 2 * sizeof(float4));
  const auto* const from =
      reinterpret_cast<const float4*>(&results[std::size_t(result) * kRays + std::size_t(ray)]);
  RayState state;
  auto* const to = reinterpret_cast<float4*>(&state);
  to[0] = __ldcg(from), to[1] = __ldcg(from + 1);
  return state;
}

/// Composites the parts of a tile. The block that finished the last of them calls it.
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

/// Stores the result of a part. \return true, in all threads of the block, if all other parts of
/// the tile are done; their results can then be read
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

/// Takes the next item from the queue, which begins with the longest lists.
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

/// True if a part in front of this one is opaque on all rays, so that this one cannot be seen.
__device__ inline bool isHidden(const SamplingArguments& a, const TilePart& item) {
  return __ldcg(&a.lists.closedAt[item.tile]) < item.part;
}

/// The samples of a ray that one thread takes.
struct Share {
  int first, end;
};
/// The groups divide the samples of a ray among them. In RenderMode::kDepth the first group takes
/// all, because that mode must stop at a sample that depends on all samples before it.
__device__ inline Share shareOf(const SampleRule& rule, const Place& place, int samples) {
  if (rule.mode == RenderMode::kDepth) return {0, place.group == 0 ? samples : 0};
  const int each = (samples + kGroups - 1) / kGroups, first = min(place.group * each, samples);
  return {first, min(first + each, samples)};
}

/// The samples of a ray that each group but the first has gathered.
using BehindShares = RayState[kGroups - 1][kRays];

/// Adds samples to the rays. Each group takes the samples behind those of the group before it; the
/// first group then joins their results from front to back, and updates s.openRays. The rays are
/// those of the first group's threads.
/// \param own        true if the thread's ray takes part
/// \param addShare   called as addShare(share, ray): it adds the samples of the share to the ray
template <class AddShare>
__device__ void addInShares(const SampleRule& rule, WorkShared& s, BehindShares& behind,
                            const Place& place, const Work& work, bool own, int samples,
                            RayState& ray, AddShare&& addShare) {
  RayState part = place.group == 0 ? ray : RayState::behind();
  if (own) addShare(shareOf(rule, place, samples), part);
  if (place.group == 0)
    ray = part;
  else if (own)
    behind[place.group - 1][place.ray] = part;
  __syncthreads();
  if (place.group != 0) return;
  if (own && rule.mode != RenderMode::kDepth)
    for (int g = 0; g < kGroups - 1 && rule.open(ray); ++g) rule.join(ray, behind[g][place.ray]);
  const unsigned open = __ballot_sync(kAllLanes, work.inPicture && rule.open(ray));
  if (place.lane == 0) s.openRays[place.half] = open;
}

/// Draws the bins of a part from front to back, and stops when all rays of the tile are closed.
/// Only the threads of the first group return a result.
/// \param ray      the ray before its first sample
/// \param drawBin  called as drawBin(list, bin, ray): it adds a bin's samples to the ray, and
///                 updates s.openRays
template <class DrawBin>
__device__ RayState drawPart(const SamplingArguments& a, WorkShared& s, const TilePart& item,
                             const Place& place, const Work& work, RayState ray,
                             DrawBin&& drawBin) {
  const unsigned inside = __ballot_sync(kAllLanes, work.inPicture);
  if (place.group == 0 && place.lane == 0) s.openRays[place.half] = inside;
  __syncthreads();
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
    return writePixel(a, place, work, drawPart(a, s, item, place, work, {}, drawBin));
  const bool hidden = __syncthreads_or(threadIdx.x == 0 && isHidden(a, item));
  if (hidden && threadIdx.x < kHalves) s.openRays[threadIdx.x] = 1;
  const RayState none = RayState::behind();
  const RayState ray = hidden ? none : drawPart(a, s, item, place, work, none, drawBin);
  if (storeResult(a, s, item, place, ray)) joinParts(a, item, place, work);
}

/// Calls draw(item) for each item that this block takes, until the queue is empty.
template <class Draw>
__device__ void forEachItem(const SamplingArguments& a, WorkShared& s, Draw&& draw) {
  while (true) {
    if (threadIdx.x == 0) takeItem(a, s);
    __syncthreads();
    if (s.hasItem == 0) return;
    const TilePart item = s.item;
    __syncthreads();  // all threads must have copied the item before the next one is written
    draw(item);
    __syncthreads();
  }
}

/// Starts a kernel whose blocks take work from the queue.
/// \param bytes   shared memory of a block
/// \param blocks  number of blocks that run at once
template <class Arguments>
void launchOverTiles(void (*kernel)(Arguments), const Arguments& arguments, std::size_t bytes,
                     int blocks, cudaStream_t stream) {
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, int(bytes)),
        "asking for shared memory");
  kernel<<<unsigned(blocks), kThreads, bytes, stream>>>(arguments);
  check(cudaGetLastError(), "drawing tiles");
}

}  // namespace esvr::cuda
