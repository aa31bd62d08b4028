#include "core/cuda/integer_sum.cuh"
#include "render/cuda/draw_work.cuh"
#include "render/voxel_window.h"

namespace esvr::cuda {
namespace {

constexpr int kLanes = DrawTuning::kLanesOfForm, kTeams = kThreads / kLanes;
/// Largest number of blocks that wait on the stack. Each split leaves one of the two halves there;
/// a block of 8 x 8 rays and 32 samples can be halved 3 + 3 + 5 = 11 times.
constexpr int kMaxBlocks = 12;
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

struct Shared : WorkShared {
  /// First the sums at the window's voxels as integers in a small unit (see Units). Integer sums
  /// do not depend on the order of their terms. finishVoxels() replaces them by the values of the
  /// voxels, as floats.
  int values[DrawTuning::kWindowVoxels];
  WindowSlab slabs[DrawTuning::kWindowSlabs];
  SampledRay rays[kRays];
  RayState behind[kGroups - 1][kRays];  ///< samples of each ray taken by all groups but the first
  unsigned long long filled;            ///< bit s is set if an ellipsoid reaches slab s
  RayBundle ofTile, ofBlock;
  Block blocks[kMaxBlocks];  ///< stack of the blocks that are not drawn yet
  int left;
  Reach reach;
  Pass pass;
};

__device__ void layRay(const VoxelArguments& a, Shared& s, const Place& place, const Work& work) {
  const View& view = a.draw.frame.view;
  const double x = view.planeX(work.firstColumn + place.column);
  const double y = view.planeY(work.firstRow + place.row);
  s.rays[place.ray] = {voxel_window::originOf(view, x, y),
                       scaled(view.directionAt(x, y), a.draw.frame.step / view.unitAlong(x, y))};
}

/// All samples of a bin, on the rays of a tile that lie in the picture.
__device__ Block wholeBlock(const TileFrame& frame, const Tile& tile) {
  return {0,
          0,
          min(kSide, frame.resolution.width - tile.column),
          min(kSide, frame.resolution.height - tile.row),
          0,
          kBinSamples};
}
__device__ bool isWhole(const TileFrame& frame, const Tile& tile, const Block& b) {
  const Block whole = wholeBlock(frame, tile);
  return b.columns == whole.columns && b.rows == whole.rows;
}
__device__ RayBundle bundleOf(const TileFrame& frame, const Tile& tile, const Block& b) {
  const int column = tile.column + b.column, row = tile.row + b.row;
  return esvr::bundleOf(frame.view, {column, column + b.columns - 1, row, row + b.rows - 1});
}

/// Puts the two halves of a block on the stack, the one in front on top. Splitting ends, because
/// the window of a single sample always fits.
__device__ void split(Shared& s, const Block& b) {
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
__device__ bool planPass(const TileFrame& frame, Shared& s, const Tile& tile, const Block& b,
                         double binSample) {
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
__device__ bool nextPass(const TileFrame& frame, Shared& s, const Tile& tile, double binSample) {
  while (s.left > 0) {
    const Block b = s.blocks[--s.left];
    if (planPass(frame, s, tile, b, binSample)) return true;
    split(s, b);
  }
  return false;
}

/// Is called by one thread.
__device__ void bundleTile(const TileFrame& frame, Shared& s, Tile tile) {
  s.ofTile = bundleOf(frame, tile, wholeBlock(frame, tile));
}

__device__ void laySlab(Shared& s, int slab) {
  s.slabs[slab] = slabOf(*s.pass.bundle, s.pass.window, s.pass.origin, slab);
}

/// Sets the window to 0 and computes where its slabs lie.
__device__ void layOut(Shared& s) {
  const VoxelWindow& w = s.pass.window;
  for (int i = int(threadIdx.x); i < w.voxels(); i += kThreads) s.values[i] = 0;
  if (int(threadIdx.x) < w.slabs) laySlab(s, int(threadIdx.x));
  if (threadIdx.x == 0) s.filled = 0;
}

/// Units of a voxel's sum, a power of two of them for 1.
struct Units {
  float ofOne, one;  ///< number of units in 1.0, and the size of a unit
};
__device__ Units unitsFor(float bound, std::uint32_t n) {
  // A value of less than 2^22 units is as fine as float32 is, and all that wholeNearest takes.
  const int e = unitExponent(bound, n, {.valueBits = 21, .sumBits = kLimits32.sumBits});
  return {ldexpf(1.0f, e), ldexpf(1.0f, -e)};
}

/// An ellipsoid relative to the window, with values in units. A team of kLanes threads adds it.
struct Placed {
  WindowKernel kernel;
  WindowOrder order;
  WindowPlace center;
};

__device__ Placed placedIn(const VoxelArguments& a, const Pass& pass, std::uint32_t id,
                           float unitsOfOne) {
  const WindowForm& f = a.forms[id];
  const WindowAxes axes = pass.window.axes;
  const Vec3& origin = a.origins[f.chunk];
  Placed p{f.kernel,
           f.order[axes.slab],
           {float(origin[axes.slab] - pass.origin.slab) + f.center[axes.slab],
            float(origin[axes.row] - pass.origin.row) + f.center[axes.row],
            float(origin[axes.column] - pass.origin.column) + f.center[axes.column]}};
  p.kernel.gain *= unitsOfOne, p.kernel.base *= unitsOfOne;
  return p;
}

/// Adds a long run of voxels without one exponential for each. The exponent is quadratic in the
/// column, so each exponential is the one before times a factor, and each factor is the one before
/// times a constant. The relative error is about 5e-6 after 12 voxels.
__device__ void addLongRun(const WindowKernel& k, const WindowRun& run, int* values) {
  const float t = float(run.first) - run.middle;
  float y = exp2f(run.nearest + run.speed * t * t);
  float factor = exp2f(run.speed * (2.0f * t + 1.0f));
  const float turn = exp2f(2.0f * run.speed);
  for (int c = run.first; c <= run.last; ++c) {
    atomicAdd(values + c, wholeNearest(k.gain / (k.plateau + y) - k.base));
    y *= factor, factor *= turn;
  }
}

/// Adds an ellipsoid to a row of voxels. \return true if the support has voxels there
__device__ bool addRow(Shared& s, const Placed& p, int slab, int row) {
  constexpr int kLong = 5;
  constexpr float kMaxCutoff = 60.0f;  // a larger exponent could overflow in addLongRun
  const WindowSlab at = s.slabs[slab];
  const int columns = s.pass.window.columns;
  const WindowRun run = runOn(p.kernel, p.order,
                              {float(slab) - p.center.slab, float(row) - p.center.row,
                               p.center.column, at.column, at.column + columns - 1});
  int* const values = &s.values[0] + (at.start + row * columns);
  if (run.last - run.first + 1 >= kLong && p.kernel.cutoff < kMaxCutoff)
    addLongRun(p.kernel, run, values);
  else
    for (int c = run.first; c <= run.last; ++c)
      atomicAdd(values + c, wholeNearest(valueAt(p.kernel, run, c)));
  return run.first <= run.last;
}

/// Adds an ellipsoid to the window, slab by slab. Each lane of the team takes every kLanes-th row.
__device__ void addForm(Shared& s, const Placed& p, int lane) {
  const VoxelWindow& w = s.pass.window;
  const WholeRange slabs =
      wholeWithin(p.center.slab - p.order.slabs, p.center.slab + p.order.slabs, {0, w.slabs - 1});
  unsigned long long filled = 0;
  for (int slab = slabs.first; slab <= slabs.last; ++slab) {
    const int first = s.slabs[slab].row;
    const WindowExtent at = rowsOf(p.kernel, p.order, float(slab) - p.center.slab);
    const WholeRange rows =
        wholeWithin(p.center.row + at.low, p.center.row + at.high, {first, first + w.rows - 1});
    for (int row = rows.first + lane; row <= rows.last; row += kLanes)
      if (addRow(s, p, slab, row)) filled |= 1ull << slab;
  }
  if (filled != 0) atomicOr(&s.filled, filled);
}

/// Turns the sums into voxels as revoxelise() does. Only slabs that ellipsoids reach and their
/// neighbours are read later, so all others are left out.
__device__ void finishVoxels(const VoxelArguments& a, Shared& s, float one) {
  const VoxelWindow& w = s.pass.window;
  const unsigned long long near = s.filled | s.filled << 1 | s.filled >> 1;
  const int ofSlab = w.rows * w.columns, lane = int(threadIdx.x) % kWarp;
  const float background = a.draw.rule.background;
  for (int slab = int(threadIdx.x) / kWarp; slab < w.slabs; slab += kWarps) {
    if ((near >> slab & 1u) == 0) continue;
    for (int i = slab * ofSlab + lane; i < (slab + 1) * ofSlab; i += kWarp) {
      const int sum = s.values[i];
      const float value = sum == 0 ? background : a.draw.voxelRule(background + float(sum) * one);
      s.values[i] = __float_as_int(value);
    }
  }
}

__device__ float along(const Vec3& v, int axis) {
  return float(axis == 0 ? v[0] : (axis == 1 ? v[1] : v[2]));
}
__device__ WindowPlace inAxes(const Vec3& v, const WindowAxes& axes) {
  return {along(v, axes.slab), along(v, axes.row), along(v, axes.column)};
}

/// Position of the block's first sample on the thread's ray, relative to the window's first voxel.
__device__ WindowPlace firstPlace(const Pass& pass, const SampledRay& ray, double binSample) {
  const WindowAxes& axes = pass.window.axes;
  Vec3 corner;
  for (int i = 0; i < 3; ++i)
    corner[i] =
        i == axes.slab ? pass.origin.slab : (i == axes.row ? pass.origin.row : pass.origin.column);
  const double number = binSample + pass.block.firstSample;
  return inAxes(difference(sum(ray.origin, scaled(ray.apart, number)), corner), axes);
}

/// The samples of a ray that one thread takes, counted from the block's first.
struct Share {
  int first, end;
};
/// The groups divide the samples of a ray among them. In RenderMode::kDepth the first group takes
/// all, because that mode must stop at a sample that depends on all samples before it.
__device__ Share shareOf(const VoxelArguments& a, const Pass& pass, const Place& place) {
  const int samples = pass.block.samples;
  if (a.draw.rule.mode == RenderMode::kDepth) return {0, place.group == 0 ? samples : 0};
  const int each = (samples + kGroups - 1) / kGroups, first = min(place.group * each, samples);
  return {first, min(first + each, samples)};
}

__device__ bool hasRay(const Pass& pass, const Place& place) {
  const Block& b = pass.block;
  return place.column >= b.column && place.column < b.column + b.columns && place.row >= b.row &&
         place.row < b.row + b.rows;
}

/// Adds the thread's share of the samples to a ray.
__device__ void addSamples(const VoxelArguments& a, const Shared& s, const Place& place,
                           const Work& work, int bin, RayState& ray) {
  const SampleRule& rule = a.draw.rule;
  const Pass& pass = s.pass;
  const Share share = shareOf(a, pass, place);
  const double toFrame = double(a.draw.frame.firstBin) * kBinSamples;
  const WindowPlace first =
      firstPlace(pass, s.rays[place.ray], toFrame + double(bin) * kBinSamples);
  const WindowPlace apart = inAxes(s.rays[place.ray].apart, pass.window.axes);
  const auto* const values = reinterpret_cast<const float*>(s.values);
  const unsigned long long filled = s.filled, near = filled | filled >> 1;
  const float ofBin = float(bin * kBinSamples + pass.block.firstSample);
  for (int i = share.first; i < share.end && rule.open(ray); ++i) {
    const float n = float(i);
    const WindowPlace p{first.slab + n * apart.slab, first.row + n * apart.row,
                        first.column + n * apart.column};
    const float number = ofBin + n;
    if ((near >> wholeBelow(p.slab) & 1u) == 0) continue;
    if (!(number >= work.firstSample && number <= work.lastSample)) continue;
    const float value = interpolate(values, s.slabs, pass.window.columns, p);
    if (value != rule.background) rule.add(ray, value, float(toFrame) + number);
  }
}

/// Draws the samples of a pass. Each group takes the samples behind those of the group before it;
/// the first group then joins their results from front to back.
__device__ void drawSamples(const VoxelArguments& a, Shared& s, const Place& place,
                            const Work& work, int bin, RayState& ray) {
  const bool own = hasRay(s.pass, place) && isOpen(s, place);
  RayState part = place.group == 0 ? ray : RayState{};
  if (own) addSamples(a, s, place, work, bin, part);
  if (place.group == 0)
    ray = part;
  else if (own)
    s.behind[place.group - 1][place.ray] = part;
  __syncthreads();
  if (place.group != 0) return;
  if (own && a.draw.rule.mode != RenderMode::kDepth)
    for (int g = 0; g < kGroups - 1 && a.draw.rule.open(ray); ++g)
      a.draw.rule.join(ray, s.behind[g][place.ray]);
  const unsigned open = __ballot_sync(kAllLanes, work.inPicture && a.draw.rule.open(ray));
  if (place.lane == 0) s.openRays[place.half] = open;
}

/// Adds the ellipsoids of a list to the window, each by a team of kLanes threads.
__device__ void addList(const VoxelArguments& a, Shared& s, const std::uint32_t* ids,
                        std::uint32_t n, float unitsOfOne) {
  const int lane = int(threadIdx.x) % kLanes;
  for (std::uint32_t i = threadIdx.x / kLanes; i < n; i += kTeams)
    addForm(s, placedIn(a, s.pass, ids[i], unitsOfOne), lane);
}

/// Computes in s.reach the part of the picture that a list's ellipsoids reach.
__device__ void findReach(const VoxelArguments& a, Shared& s, const std::uint32_t* ids,
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
__device__ Block reachedBlock(const TileFrame& frame, const Shared& s, const Tile& tile,
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
__device__ bool planBin(const VoxelArguments& a, Shared& s, const Tile& tile,
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
__device__ bool takePass(const TileFrame& frame, Shared& s, const Tile& tile, double binSample) {
  return __syncthreads_or(threadIdx.x == 0 && nextPass(frame, s, tile, binSample)) != 0;
}

__device__ void drawBin(const VoxelArguments& a, Shared& s, const Place& place, const Work& work,
                        std::size_t list, int bin, RayState& ray) {
  const std::uint32_t n = a.draw.lists.counts[list];
  const std::uint32_t* const ids = a.draw.lists.entries + (a.draw.lists.ends[list] - n);
  const Units units = unitsFor(a.bound, n);
  const Tile tile{work.firstColumn, work.firstRow};
  const double binSample = double(a.draw.frame.firstBin + bin) * kBinSamples;
  bool planned = planBin(a, s, tile, ids, n, binSample);
  for (; planned || takePass(a.draw.frame, s, tile, binSample); planned = false) {
    layOut(s);
    __syncthreads();
    addList(a, s, ids, n, units.ofOne);
    __syncthreads();
    if (s.filled == 0) continue;
    finishVoxels(a, s, units.one);
    __syncthreads();
    drawSamples(a, s, place, work, bin, ray);
    __syncthreads();
  }
}

__global__ void __launch_bounds__(kThreads, DrawTuning::kBlocksPerMultiprocessor)
    sampleVoxelsKernel(const __grid_constant__ VoxelArguments a) {
  extern __shared__ float4 memory[];
  Shared& s = *reinterpret_cast<Shared*>(memory);
  if (!listsFit(*a.draw.lists.counters, a.draw.lists, a.draw.frame.between)) return;
  const Place place;
  forEachItem(a.draw, s, [&](const TilePart& item) {
    const Work work = workOf(a.draw, item.tile, place);
    if (place.group == 0) layRay(a, s, place, work);
    if (threadIdx.x == 0) bundleTile(a.draw.frame, s, {work.firstColumn, work.firstRow});
    drawItem(a.draw, s, item, place, work, [&](std::size_t list, int bin, RayState& ray) {
      drawBin(a, s, place, work, list, bin, ray);
    });
  });
}

}  // namespace

void launchDrawVoxels(const VoxelArguments& arguments, int multiprocessors, cudaStream_t stream) {
  launchOverTiles(sampleVoxelsKernel, arguments, sizeof(Shared),
                  multiprocessors * DrawTuning::kBlocksPerMultiprocessor, stream);
}

}  // namespace esvr::cuda
