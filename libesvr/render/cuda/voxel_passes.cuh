#pragma once
/// Divides the samples of a bin into passes. A pass draws a range of samples on a rectangle of a
/// tile's rays, so that the window of voxels that these samples are interpolated from fits into
/// shared memory. A bin is one pass if its window fits.

#include "render/cuda/draw_work.cuh"
#include "render/voxel_window.h"

namespace esvr::cuda {

/// Largest number of blocks that wait on the stack. Each split leaves one of the two halves there;
/// a block of 8 x 8 rays and 32 samples can be halved 3 + 3 + 5 = 11 times.
inline constexpr int kMaxBlocks = 12;
static_assert(kSide == 8 && kBinSamples == 32 && DrawTuning::kWindowSlabs <= 64);

/// A range of samples on a rectangle of rays. Columns and rows count from the tile's first pixel,
/// samples from the bin's first one.
struct Block {
  int column, row, columns, rows;
  int firstSample, samples;
};

/// The part of the picture and the range of depths that a list's ellipsoids reach.
struct Reach {
  int firstColumn, lastColumn, firstRow, lastRow;  ///< pixels of the picture
  /// Depths along forward, as the bit patterns of floats. No depth is negative, so the patterns
  /// have the order of the floats, and atomicMin and atomicMax work on them.
  int nearest, farthest;
};

/// A block that is drawn at once, and the window of voxels that its samples are interpolated from.
struct Pass {
  Block block;
  const RayBundle* bundle;
  VoxelWindow window;
  WindowOrigin origin;
};

/// The first pixel of a tile.
struct Tile {
  int column, row;
};

struct SampledRay {
  Vec3 origin, apart;  ///< sample n of the frame lies at origin + n apart
};

/// Shared memory of a block.
struct VoxelShared : WorkShared {
  /// First the sums at the window's voxels as integers in a small unit (see Units). Integer sums
  /// do not depend on the order of their terms. finishVoxels() replaces them by the values of the
  /// voxels, as floats.
  int values[DrawTuning::kWindowVoxels];
  WindowSlab slabs[DrawTuning::kWindowSlabs];
  SampledRay rays[kRays];
  BehindShares behind;
  unsigned long long filled;  ///< bit s is set if an ellipsoid reaches slab s
  RayBundle ofTile, ofBlock;
  Block blocks[kMaxBlocks];  ///< stack of the blocks that are not drawn yet
  int left;
  Reach reach;
  Pass pass;
};

/// All samples of a bin, on the rays of a tile that lie in the picture.
__device__ inline Block wholeBlock(const TileFrame& frame, const Tile& tile) {
  return {0,
          0,
          min(kSide, frame.resolution.width - tile.column),
          min(kSide, frame.resolution.height - tile.row),
          0,
          kBinSamples};
}
__device__ inline bool isWhole(const TileFrame& frame, const Tile& tile, const Block& b) {
  const Block whole = wholeBlock(frame, tile);
  return b.columns == whole.columns && b.rows == whole.rows;
}
__device__ inline RayBundle bundleOf(const TileFrame& frame, const Tile& tile, const Block& b) {
  const int column = tile.column + b.column, row = tile.row + b.row;
  return esvr::bundleOf(frame.view, {column, column + b.columns - 1, row, row + b.rows - 1});
}

/// Puts the two halves of a block on the stack, the one in front on top. Splitting ends, because
/// the window of a single sample always fits.
__device__ inline void split(VoxelShared& s, const Block& b) {
  Block one = b, other = b;
  if (b.samples > DrawTuning::kFewSamples || (b.columns * b.rows == 1 && b.samples > 1)) {
    one.samples = b.samples / 2;
    other.firstSample += one.samples, other.samples -= one.samples;
  } else if (b.columns >= b.rows) {
    one.columns = b.columns / 2;
    other.column += one.columns, other.columns -= one.columns;
  } else {
    one.rows = b.rows / 2;
    other.row += one.rows, other.rows -= one.rows;
  }
  s.blocks[s.left++] = other;
  s.blocks[s.left++] = one;
}

/// Makes the pass for a block. \return false if the block's window is too large
__device__ inline bool planPass(const TileFrame& frame, VoxelShared& s, const Tile& tile,
                                const Block& b, double binSample) {
  const WindowLimits limits{DrawTuning::kWindowSlabs, DrawTuning::kWindowVoxels};
  const bool whole = isWhole(frame, tile, b);
  if (!whole) s.ofBlock = bundleOf(frame, tile, b);
  const RayBundle& bundle = whole ? s.ofTile : s.ofBlock;
  const double first = binSample + b.firstSample;
  const DepthRange depths = depthsOf(bundle, first, first + (b.samples - 1), frame.step);
  if (!windowFor(bundle, depths, limits, s.pass.window)) return false;
  s.pass.block = b;
  s.pass.bundle = &bundle;
  s.pass.origin = originOf(bundle, s.pass.window);
  return true;
}

/// Takes blocks from the stack, and splits them, until the window of one fits. It is called by one
/// thread. \return false if no block is left
__device__ inline bool nextPass(const TileFrame& frame, VoxelShared& s, const Tile& tile,
                                double binSample) {
  while (s.left > 0) {
    const Block b = s.blocks[--s.left];
    if (planPass(frame, s, tile, b, binSample)) return true;
    split(s, b);
  }
  return false;
}

/// Is called by one thread.
__device__ inline void bundleTile(const TileFrame& frame, VoxelShared& s, Tile tile) {
  s.ofTile = bundleOf(frame, tile, wholeBlock(frame, tile));
}

/// Computes in s.reach the part of the picture that a list's ellipsoids reach.
__device__ inline void findReach(const VoxelArguments& a, VoxelShared& s, const std::uint32_t* ids,
                                 std::uint32_t n) {
  constexpr int kMaxInt = 0x7fffffff;
  if (threadIdx.x == 0) s.reach = {kMaxInt, -1, kMaxInt, -1, kMaxInt, 0};
  __syncthreads();
  for (std::uint32_t i = threadIdx.x; i < n; i += kThreads) {
    const Footprint& f = a.footprints[ids[i]];
    atomicMin(&s.reach.firstColumn, int(f.firstColumn));
    atomicMax(&s.reach.lastColumn, int(f.lastColumn));
    atomicMin(&s.reach.firstRow, int(f.firstRow));
    atomicMax(&s.reach.lastRow, int(f.lastRow));
    atomicMin(&s.reach.nearest, __float_as_int(f.nearest));
    atomicMax(&s.reach.farthest, __float_as_int(f.farthest));
  }
  __syncthreads();
}

/// The part of the tile and the bin that ellipsoids reach. Its number of columns, rows or samples
/// is not positive if they reach none.
__device__ inline Block reachedBlock(const TileFrame& frame, const VoxelShared& s, const Tile& tile,
                                     double binSample) {
  const Block whole = wholeBlock(frame, tile);
  const Reach& r = s.reach;
  const int column = max(r.firstColumn - tile.column, 0), row = max(r.firstRow - tile.row, 0);
  const UnitRange& unit = s.ofTile.unit;
  const double nearest = floor(double(__int_as_float(r.nearest)) * unit.min / frame.step);
  const double farthest = ceil(double(__int_as_float(r.farthest)) * unit.max / frame.step);
  const int first = int(ellipsoid_math::clampedTo(nearest - binSample, 0.0, kBinSamples));
  const int last = int(ellipsoid_math::clampedTo(farthest - binSample, -1.0, kBinSamples - 1));
  return {column,
          row,
          min(r.lastColumn - tile.column, whole.columns - 1) - column + 1,
          min(r.lastRow - tile.row, whole.rows - 1) - row + 1,
          first,
          last - first + 1};
}

/// Makes one pass for the whole bin if its window fits. Otherwise it puts the part that the
/// ellipsoids reach on the stack. \return true, in all threads, if there is a pass for the bin
__device__ inline bool planBin(const VoxelArguments& a, VoxelShared& s, const Tile& tile,
                               const std::uint32_t* ids, std::uint32_t n, double binSample) {
  const TileFrame& frame = a.draw.frame;
  if (threadIdx.x == 0) s.left = 0;
  const bool fits =
      threadIdx.x == 0 && planPass(frame, s, tile, wholeBlock(frame, tile), binSample);
  if (__syncthreads_or(fits)) return true;
  findReach(a, s, ids, n);
  if (threadIdx.x != 0) return false;
  const Block reached = reachedBlock(frame, s, tile, binSample);
  s.blocks[0] = reached;
  s.left = reached.columns > 0 && reached.rows > 0 && reached.samples > 0 ? 1 : 0;
  return false;
}

/// Makes the next pass from the stack. \return false, in all threads, if no block is left
__device__ inline bool takePass(const TileFrame& frame, VoxelShared& s, const Tile& tile,
                                double binSample) {
  return __syncthreads_or(threadIdx.x == 0 && nextPass(frame, s, tile, binSample)) != 0;
}

}  // namespace esvr::cuda
