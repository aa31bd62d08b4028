#include "render/cuda/brick_draw.h"

#include <climits>

#include "core/cuda/reduce.cuh"
#include "core/cuda/thread_number.cuh"
#include "render/brick_cover.h"

namespace esvr::cuda {
namespace {

constexpr int kSide = kMarchTileSide;
constexpr int kThreads = 128;

__host__ __device__ int tilesAlong(int pixels) { return (pixels + kSide - 1) / kSide; }

__global__ void clearRanges(int2* ranges, int tiles) {
  const int tile = int(blockIdx.x * blockDim.x + threadIdx.x);
  if (tile < tiles) ranges[tile] = make_int2(INT_MAX, INT_MIN);
}

/// Lanes that look at a brick together, one for each corner.
constexpr int kLanes = kCellCorners;

__device__ CoverView coverView(const BrickDrawArguments& a) {
  const MarchScene scene = a.scene.at(a.scene.last());
  return {scene.view, a.resolution, scene.step, a.firstSample};
}

/// The cover of a brick, on all lanes of its group.
__device__ BrickCover coverOf(const CoverView& v, const Coord& brick) {
  const BrickCover own = coverOfCorner(v, brick, int(threadIdx.x) % kLanes);
  const auto least = [](auto n) {
    return reduceLanes<kLanes>(n, [](auto x, auto y) { return x < y ? x : y; });
  };
  const auto largest = [](auto n) {
    return reduceLanes<kLanes>(n, [](auto x, auto y) { return x < y ? y : x; });
  };
  return {least(own.firstColumn),
          largest(own.lastColumn),
          least(own.firstRow),
          largest(own.lastRow),
          v.view.perspective ? firstSampleOf(v, brick) : least(own.first),
          largest(own.last)};
}

/// Widens the sample ranges of the tiles that a cover meets. The lanes of a group share them.
__device__ void widen(const BrickDrawArguments& a, const CoverView& v, const BrickCover& c) {
  CoveredTiles tiles = tilesOf(v, c, kSide);
  const int past = min(tiles.firstRow + tiles.rows, a.firstTileRow + a.tileRows);
  tiles.firstRow = max(tiles.firstRow, a.firstTileRow);
  const int count = tiles.columns * (past - tiles.firstRow);
  for (int n = int(threadIdx.x) % kLanes; n < count; n += kLanes) {
    const int row = tiles.firstRow - a.firstTileRow + n / tiles.columns;
    int2& range =
        a.ranges[row * tilesAlong(a.resolution.width) + tiles.firstColumn + n % tiles.columns];
    atomicMin(&range.x, c.first);
    atomicMax(&range.y, c.last);
  }
}

/// Each group of lanes looks at one brick and widens the sample range of every tile that the brick
/// may cover. Bricks that are known to be vacant do not count. If there are several levels, they do:
/// means may be the background where voxels are not.
__global__ void __launch_bounds__(kThreads) findRanges(const BrickDrawArguments a) {
  const std::size_t brick = threadNumber() / kLanes;
  if (brick >= a.count) return;
  if (a.scene.bounds.oneLevel() &&
      a.slots.slot(a.firstBrick + std::uint32_t(brick)) == BrickSlotsView::kVacant)
    return;
  const CoverView view = coverView(a);
  widen(a, view, coverOf(view, a.bricks[brick]));
}

/// Asks for missing bricks.
struct Asking {
  const BrickDemand& demand;
  int left;  ///< number of further bricks that the ray asks for

  __device__ void entered(std::uint32_t slot) const {
    if (demand.stamps != nullptr && demand.stamps[slot] != demand.now)
      demand.stamps[slot] = demand.now;
  }
  __device__ bool wantsMore(std::uint32_t brick, std::uint32_t slot) {
    constexpr auto kMissing = BrickSlotsView::kMissing, kAsked = BrickSlotsView::kAsked;
    if (slot == kMissing && atomicCAS(&demand.slotOf[brick], kMissing, kAsked) == kMissing)
      demand.bricks[atomicAdd(&demand.counts->bricks, 1u)] = brick;
    return left-- > 0;
  }
};

/// The pixel of a thread in a tile of the band.
struct TilePixel {
  int column, row, rowOfBand;
  [[nodiscard]] __device__ bool within(const BrickDrawArguments& a) const {
    return column < a.resolution.width && row < a.resolution.height;
  }
};
__device__ TilePixel pixelOf(const BrickDrawArguments& a, std::uint32_t tile) {
  const int columns = tilesAlong(a.resolution.width);
  const int rowOfBand = int(tile) / columns * kSide + int(threadIdx.x) / kSide;
  return {int(tile) % columns * kSide + int(threadIdx.x) % kSide,
          rowOfBand + a.firstTileRow * kSide, rowOfBand};
}

/// Marches the ray of a thread and writes its pixel if it ends. \return whether it ends
template <MarchCode kCode>
__device__ bool marchRay(const BrickDrawArguments& a, std::uint32_t tile, int2 range,
                         RayProgress& ray) {
  const TilePixel p = pixelOf(a, tile);
  if (!p.within(a)) return true;
  const double side = LevelFrame{a.scene.bounds.last}.side();
  const SampleRange wanted{(a.firstSample + double(range.x)) * side,
                           (a.firstSample + double(range.y)) * side};
  Asking asking{a.demand, a.demand.ahead};
  ray.ray.first = 0;  // so that the code for parts of rays is left out
  if (!marchLevels<kCode>(a.scene, a.slots, p.column, p.row, wanted, ray, asking)) return false;
  const PixelColor c = finished(a.scene, ray);
  a.pixels[std::size_t(p.rowOfBand) * std::size_t(a.resolution.width) + std::size_t(p.column)] =
      make_float4(c.r, c.g, c.b, c.alpha);
  return true;
}

/// Lists what a block works on if one of its rays waits.
__device__ void listIfWaiting(const BrickDrawArguments& a, bool ended, std::uint32_t number) {
  const bool any = __syncthreads_or(ended ? 0 : 1) != 0;
  if (any && threadIdx.x == 0) a.waiting[atomicAdd(&a.demand.counts->waiting, 1u)] = number;
}

/// Blocks that run on a multiprocessor at the same time. More leave fewer registers to each: 16 were
/// faster than 12 by up to 9 % for scenes of one level, and 8 faster than 16 by 2 % for others (H200).
constexpr int kBlocksOfOne = 16, kBlocksOfMany = 8;

/// Each block draws one tile and each thread one ray. The rays of a warp are 8 x 4 neighbours. The
/// first pass and later ones share the code, because two kernels could be compiled to different
/// roundings.
template <bool kHasOneLevel, bool kIsUsual, bool kIsShaded>
__global__ void __launch_bounds__(kMarchTilePixels,
                                  kHasOneLevel && !kIsShaded ? kBlocksOfOne : kBlocksOfMany)
    marchKernel(const BrickDrawArguments a, const WaitingTiles w) {
  const bool isFirst = w.count == 0;
  const std::uint32_t entry = isFirst || w.begin ? blockIdx.x : w.entries[blockIdx.x];
  const std::uint32_t tile = isFirst ? entry : w.tiles[entry];
  const int2 range = a.ranges[tile];
  if (range.x > range.y) return;
  RayProgress* const kept =
      isFirst ? nullptr : w.rays + std::size_t(entry) * kMarchTilePixels + threadIdx.x;
  RayProgress ray;
  if (kept != nullptr && !w.begin) ray = *kept;
  const bool ended =
      ray.next < 0 || marchRay<MarchCode{kHasOneLevel, kIsUsual, kIsShaded}>(a, tile, range, ray);
  if (ended) ray.next = -1;
  if (kept != nullptr) *kept = ray;
  if (a.demand.slotOf != nullptr) listIfWaiting(a, ended, entry);
}

using MarchKernel = void (*)(BrickDrawArguments, WaitingTiles);

MarchKernel kernelFor(const MarchCode& code) {
  if (code.isShaded)
    return code.hasOneLevel ? marchKernel<true, false, true> : marchKernel<false, false, true>;
  if (code.hasOneLevel)
    return code.isUsual ? marchKernel<true, true, false> : marchKernel<true, false, false>;
  return code.isUsual ? marchKernel<false, true, false> : marchKernel<false, false, false>;
}

}  // namespace

void launchRanges(const BrickDrawArguments& a, cudaStream_t stream) {
  const int tiles = tilesAlong(a.resolution.width) * a.tileRows;
  clearRanges<<<blocksFor(std::size_t(tiles), kThreads), kThreads, 0, stream>>>(a.ranges, tiles);
  check(cudaGetLastError(), "clearing tiles");
  findRanges<<<blocksFor(std::size_t(a.count) * kLanes, kThreads), kThreads, 0, stream>>>(a);
  check(cudaGetLastError(), "looking at bricks");
}

void launchMarch(const BrickDrawArguments& a, const WaitingTiles& w, cudaStream_t stream) {
  const int tiles = tilesAlong(a.resolution.width) * a.tileRows;
  kernelFor(codeFor(
      a.scene))<<<w.count == 0 ? unsigned(tiles) : w.count, kMarchTilePixels, 0, stream>>>(a, w);
  check(cudaGetLastError(), "marching bricks");
}

}  // namespace esvr::cuda
