#include <climits>

#include "core/cuda/reduce.cuh"
#include "core/cuda/thread_number.cuh"
#include "render/cuda/tile_band.h"

namespace esvr::cuda {
namespace {

constexpr int kThreads = 128;

__global__ void clearRanges(int2* ranges, int tiles) {
  const int tile = int(threadNumber());
  if (tile < tiles) ranges[tile] = make_int2(INT_MAX, INT_MIN);
}

/// Lanes that look at a brick together, one for each corner.
constexpr int kLanes = kCellCorners;

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
__device__ void widen(const TileBand& band, const CoverView& v, const BrickCover& c) {
  CoveredTiles tiles = tilesOf(v, c, kMarchTileSide);
  const int past = min(tiles.firstRow + tiles.rows, band.firstTileRow + band.tileRows);
  tiles.firstRow = max(tiles.firstRow, band.firstTileRow);
  const int count = tiles.columns * (past - tiles.firstRow);
  for (int n = int(threadIdx.x) % kLanes; n < count; n += kLanes) {
    const int row = tiles.firstRow - band.firstTileRow + n / tiles.columns;
    int2& range = band.ranges[row * TileBand::tilesAlong(band.resolution.width) +
                              tiles.firstColumn + n % tiles.columns];
    atomicMin(&range.x, c.first);
    atomicMax(&range.y, c.last);
  }
}

/// Each group of lanes looks at one brick and widens the sample range of every tile that the brick
/// may cover.
__global__ void __launch_bounds__(kThreads)
    widenRanges(const TileBand band, const CoveringBricks bricks) {
  const std::size_t brick = threadNumber() / kLanes;
  if (brick >= bricks.count) return;
  if (bricks.slotOf != nullptr && bricks.slotOf[bricks.first + brick] == BrickSlotsView::kVacant)
    return;
  const CoverView view{bricks.view, band.resolution, bricks.step, band.firstSample};
  widen(band, view, coverOf(view, bricks.bricks[brick]));
}

}  // namespace

void launchClearRanges(const TileBand& band, cudaStream_t stream) {
  const int tiles = band.tiles();
  clearRanges<<<blocksFor(std::size_t(tiles), kThreads), kThreads, 0, stream>>>(band.ranges, tiles);
  check(cudaGetLastError(), "clearing tiles");
}

void launchWidenRanges(const TileBand& band, const CoveringBricks& bricks, cudaStream_t stream) {
  if (bricks.count == 0) return;
  widenRanges<<<blocksFor(std::size_t(bricks.count) * kLanes, kThreads), kThreads, 0, stream>>>(
      band, bricks);
  check(cudaGetLastError(), "looking at bricks");
}

}  // namespace esvr::cuda
