#include "core/cuda/integer_sum.cuh"
#include "render/cuda/draw_work.cuh"
#include "render/voxel_window.h"

namespace esvr::cuda {
namespace {

constexpr int kLanes = DrawTuning::kLanesOfForm, kTeams = kThreads / kLanes;
/// A block that is split leaves one behind; each side is halved three times, samples five.
constexpr int kMaxBlocks = 12;
static_assert(kSide == 8 && kBinSamples == 32 && DrawTuning::kWindowSlabs <= 64);

/// Samples of a rectangle of a tile's rays: pixels from the tile's first, samples from the bin's.
struct Block {
  int column, row, columns, rows;
  int firstSample, samples;
};

/// The part of a tile and a bin that ellipsoids reach, first and last: pixels of the picture, and
/// depths along forward as the bits of floats, which are none of them negative.
struct Reach {
  int firstColumn, lastColumn, firstRow, lastRow;
  int nearest, farthest;
};

/// A block is drawn at once: its samples, and the voxels that they lie between.
struct Pass {
  Block block;
  const RayBundle* bundle;
  VoxelWindow window;
  WindowOrigin origin;
};

/// Its first pixel.
struct Tile {
  int column, row;
};

struct SampledRay {
  Vec3 origin, apart;  ///< the first sample and the distance between samples
};

struct Shared : WorkShared {
  /// First the sums of the window's voxels, in units so fine that the sum of all intensities just
  /// fits: sums of whole numbers have no order. Then what voxels they are, as float.
  int values[DrawTuning::kWindowVoxels];
  WindowSlab slabs[DrawTuning::kWindowSlabs];
  SampledRay rays[kRays];
  RayState behind[kGroups - 1][kRays];  ///< the rays of all groups but the first
  unsigned long long filled;            ///< a bit a slab that something was added to
  RayBundle ofTile, ofBlock;
  Block blocks[kMaxBlocks];  ///< that are left, the next one last
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

/// All of a tile that is in the picture, and of a bin.
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

/// In front first. One sample of one ray always has a window.
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

/// \return false where the block's window is too large
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

/// The next block that has a window; larger ones are split on the way. By one thread.
__device__ bool nextPass(const TileFrame& frame, Shared& s, const Tile& tile, double binSample) {
  while (s.left > 0) {
    const Block b = s.blocks[--s.left];
    if (planPass(frame, s, tile, b, binSample)) return true;
    split(s, b);
  }
  return false;
}

/// By one thread.
__device__ void bundleTile(const TileFrame& frame, Shared& s, Tile tile) {
  s.ofTile = bundleOf(frame, tile, wholeBlock(frame, tile));
}

__device__ void laySlab(Shared& s, int slab) {
  s.slabs[slab] = slabOf(*s.pass.bundle, s.pass.window, s.pass.origin, slab);
}

/// Empties the window and says where its slabs lie.
__device__ void layOut(Shared& s) {
  const VoxelWindow& w = s.pass.window;
  for (int i = int(threadIdx.x); i < w.voxels(); i += kThreads) s.values[i] = 0;
  if (int(threadIdx.x) < w.slabs) laySlab(s, int(threadIdx.x));
  if (threadIdx.x == 0) s.filled = 0;
}

/// Units of a voxel's sum, a power of two of them for 1.
struct Units {
  float ofOne, one;
};
__device__ Units unitsFor(float bound, std::uint32_t n) {
  // A value of less than 2^22 units is as fine as float32 is, and all that wholeNearest takes.
  const int e = unitExponent(bound, n, {.valueBits = 21, .sumBits = kLimits32.sumBits});
  return {ldexpf(1.0f, e), ldexpf(1.0f, -e)};
}

/// An ellipsoid in the window, its values in units, for the threads of a team.
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

/// The values of a run that is long, to `values` from its first on. Its exponentials are each the
/// one before times a factor, and the factors likewise: after 12 of them some 5e-6 off.
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

/// \return true where the support has voxels there
__device__ bool addRow(Shared& s, const Placed& p, int slab, int row) {
  constexpr int kLong = 5;  // and so wide a support that nothing overflows
  constexpr float kMaxCutoff = 60.0f;
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

/// The rows of voxels that a support meets, slab by slab, a lane each.
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

/// Turns the sums into voxels as revoxelise() does, near slabs that have any.
__device__ void finishVoxels(const VoxelArguments& a, Shared& s, float one) {
  const VoxelWindow& w = s.pass.window;
  const unsigned long long near = s.filled | s.filled << 1 | s.filled >> 1;
  const int ofSlab = w.rows * w.columns, lane = int(threadIdx.x) % kWarp;
  const float background = a.draw.rule.background;
  for (int slab = int(threadIdx.x) / kWarp; slab < w.slabs; slab += kWarps) {
    if ((near >> slab & 1u) == 0) continue;
    for (int i = slab * ofSlab + lane; i < (slab + 1) * ofSlab; i += kWarp) {
      const int sum = s.values[i];
      const float value = sum == 0 ? background : a.rule(background + float(sum) * one);
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

/// The first sample of the block on the thread's ray, from the window's first voxel.
__device__ WindowPlace firstPlace(const Pass& pass, const SampledRay& ray, double binSample) {
  const WindowAxes& axes = pass.window.axes;
  Vec3 corner;
  for (int i = 0; i < 3; ++i)
    corner[i] =
        i == axes.slab ? pass.origin.slab : (i == axes.row ? pass.origin.row : pass.origin.column);
  const double number = binSample + pass.block.firstSample;
  return inAxes(difference(sum(ray.origin, scaled(ray.apart, number)), corner), axes);
}

/// A thread's share of its ray's samples, counted from the block's first.
struct Share {
  int first, end;
};
/// Only from front to back is it known how deep a ray comes: then the first group takes all.
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

/// Adds a thread's share to a ray.
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

/// Each group of threads takes samples behind those of the group before.
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

/// A list's ellipsoids, a team of lanes each.
__device__ void addList(const VoxelArguments& a, Shared& s, const std::uint32_t* ids,
                        std::uint32_t n, float unitsOfOne) {
  const int lane = int(threadIdx.x) % kLanes;
  for (std::uint32_t i = threadIdx.x / kLanes; i < n; i += kTeams)
    addForm(s, placedIn(a, s.pass, ids[i], unitsOfOne), lane);
}

/// Bounds the part that a list's ellipsoids reach, into s.reach.
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

/// The part of the tile and the bin that is reached; none of columns, rows or samples where none
/// is.
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

/// Plans a pass for all of the bin where there is a window for that; else leaves in s.blocks what
/// the ellipsoids reach. \return true in all threads where there is the pass
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

/// \return false in all threads where no block is left
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
