#include "render/cuda/brick_draw.h"

#include <climits>

#include "core/cell_corner.h"
#include "core/cuda/thread_number.cuh"

namespace esvr::cuda {
namespace {

constexpr int kSide = kMarchTileSide, kTilePixels = kSide * kSide;
constexpr int kThreads = 128, kBlocksPerMultiprocessor = 8;

__host__ __device__ int tilesAlong(int pixels) { return (pixels + kSide - 1) / kSide; }

__global__ void clearRanges(int2* ranges, int tiles) {
  const int tile = int(blockIdx.x * blockDim.x + threadIdx.x);
  if (tile < tiles) ranges[tile] = make_int2(INT_MAX, INT_MIN);
}

/// The part of the picture that a brick of cells may cover, and its distances from the eye.
struct Cover {
  double firstColumn, lastColumn, firstRow, lastRow;  ///< pixels
  double nearest, farthest;                           ///< voxels
};

__device__ Vec3 cornerOf(const Coord& brick, int corner) {
  const Coord step = stepToCorner(corner);
  return {double((brick.x + step.x) * kBrickSide), double((brick.y + step.y) * kBrickSide),
          double((brick.z + step.z) * kBrickSide)};
}

__device__ double distanceTo(const Coord& brick, const Vec3& eye) {
  const Vec3 low = cornerOf(brick, 0), high = cornerOf(brick, kCellCorners - 1);
  double squares = 0.0;
  for (int a = 0; a < 3; ++a) {
    const double away = fmax(fmax(low[a] - eye[a], eye[a] - high[a]), 0.0);
    squares += away * away;
  }
  return sqrt(squares);
}

__device__ void add(const View& view, const Vec3& corner, Cover& c) {
  const Vec3 seen = view.coordinates(difference(corner, view.eye));
  const double along = view.perspective ? sqrt(inner(seen, seen)) : seen[2];
  c.farthest = fmax(c.farthest, along);
  if (!view.perspective) c.nearest = fmin(c.nearest, along);
  constexpr double kAll = 1e9;
  const bool before = !view.perspective || seen[2] > 1e-3;
  const double scale = view.perspective ? 1.0 / seen[2] : 1.0;
  const double column = view.columnAt(seen[0] * scale), row = view.rowAt(seen[1] * scale);
  c.firstColumn = fmin(c.firstColumn, before ? column : -kAll);
  c.lastColumn = fmax(c.lastColumn, before ? column : kAll);
  c.firstRow = fmin(c.firstRow, before ? row : -kAll);
  c.lastRow = fmax(c.lastRow, before ? row : kAll);
}

/// If a corner of the brick lies behind the eye, it cannot be projected, and the result is the
/// whole picture.
__device__ Cover coverOf(const View& view, const Coord& brick) {
  constexpr double kAll = 1e9;
  Cover c{kAll, -kAll, kAll, -kAll, view.perspective ? distanceTo(brick, view.eye) : 1e300, -1e300};
  for (int corner = 0; corner < kCellCorners; ++corner) add(view, cornerOf(brick, corner), c);
  return c;
}

__device__ int tileAt(double pixel, int count) {
  return int(floor(fmin(fmax(pixel, 0.0), double(count - 1)))) / kSide;
}

/// Each warp handles one brick: it widens the sample range of every tile that the brick may cover.
__global__ void __launch_bounds__(kThreads) findRanges(const BrickDrawArguments a) {
  const int lane = int(threadIdx.x) % kWarp, tileColumns = tilesAlong(a.resolution.width);
  for (std::size_t i = warpNumber(); i < a.count; i += warpCount()) {
    const Cover c = coverOf(a.scene.view, a.bricks[i]);
    const bool seen = c.farthest >= 0.0 && c.lastColumn >= -0.5 && c.lastRow >= -0.5 &&
                      c.firstColumn <= a.resolution.width && c.firstRow <= a.resolution.height;
    if (!seen) continue;
    const int first = int(floor(fmax(c.nearest, 0.0) / a.scene.step - a.firstSample));
    const int last = int(ceil(c.farthest / a.scene.step - a.firstSample));
    const int firstColumn = tileAt(c.firstColumn - 0.5, a.resolution.width);
    const int lastColumn = tileAt(c.lastColumn + 0.5, a.resolution.width);
    const int firstRow = max(tileAt(c.firstRow - 0.5, a.resolution.height), a.firstTileRow);
    const int lastRow =
        min(tileAt(c.lastRow + 0.5, a.resolution.height), a.firstTileRow + a.tileRows - 1);
    const int columns = lastColumn - firstColumn + 1, rows = lastRow - firstRow + 1;
    for (int t = lane; t < columns * rows; t += kWarp) {
      const int row = firstRow + t / columns - a.firstTileRow, column = firstColumn + t % columns;
      int2& range = a.ranges[row * tileColumns + column];
      atomicMin(&range.x, first);
      atomicMax(&range.y, last);
    }
  }
}

/// Each block draws one tile and each thread one ray. The rays of a warp are 8 x 4 neighbours.
__global__ void __launch_bounds__(kTilePixels) marchKernel(const BrickDrawArguments a) {
  const int2 range = a.ranges[blockIdx.x];
  if (range.x > range.y) return;
  const int tileColumns = tilesAlong(a.resolution.width);
  const int column = int(blockIdx.x) % tileColumns * kSide + int(threadIdx.x) % kSide;
  const int rowOfBand = int(blockIdx.x) / tileColumns * kSide + int(threadIdx.x) / kSide;
  const int row = rowOfBand + a.firstTileRow * kSide;
  if (column >= a.resolution.width || row >= a.resolution.height) return;
  const PixelColor c =
      marchBricks(a.atlas, a.scene, column, row,
                  {a.firstSample + double(range.x), a.firstSample + double(range.y)});
  a.pixels[std::size_t(rowOfBand) * std::size_t(a.resolution.width) + std::size_t(column)] =
      make_float4(c.r, c.g, c.b, c.alpha);
}

}  // namespace

void launchBricks(const BrickDrawArguments& a, int multiprocessors, cudaStream_t stream) {
  const int tiles = tilesAlong(a.resolution.width) * a.tileRows;
  clearRanges<<<blocksFor(std::size_t(tiles), kThreads), kThreads, 0, stream>>>(a.ranges, tiles);
  check(cudaGetLastError(), "clearing tiles");
  findRanges<<<unsigned(multiprocessors * kBlocksPerMultiprocessor), kThreads, 0, stream>>>(a);
  check(cudaGetLastError(), "looking at bricks");
  marchKernel<<<unsigned(tiles), kTilePixels, 0, stream>>>(a);
  check(cudaGetLastError(), "marching bricks");
}

}  // namespace esvr::cuda
