#pragma once
/// Adds ellipsoids to a pass' window of voxels, in shared memory, and turns the sums into voxels.

#include "core/cuda/integer_sum.cuh"
#include "render/cuda/voxel_passes.cuh"

namespace esvr::cuda {

inline constexpr int kLanes = DrawTuning::kLanesOfForm, kTeams = kThreads / kLanes;

__device__ inline void laySlab(VoxelShared& s, int slab) {
  s.slabs[slab] = slabOf(*s.pass.bundle, s.pass.window, s.pass.origin, slab);
}

/// Sets the window to 0 and computes where its slabs lie.
__device__ inline void layOut(VoxelShared& s) {
  const VoxelWindow& w = s.pass.window;
  for (int i = int(threadIdx.x); i < w.voxels(); i += kThreads) s.values[i] = 0;
  if (int(threadIdx.x) < w.slabs) laySlab(s, int(threadIdx.x));
  if (threadIdx.x == 0) s.filled = 0;
}

/// Units of a voxel's sum, a power of two of them for 1.
struct Units {
  float ofOne, one;  ///< number of units in 1.0, and the size of a unit
};
__device__ inline Units unitsFor(float bound, std::uint32_t n) {
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

__device__ inline Placed placedIn(const VoxelArguments& a, const Pass& pass, std::uint32_t id,
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
__device__ inline void addLongRun(const WindowKernel& k, const WindowRun& run, int* values) {
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
__device__ inline bool addRow(VoxelShared& s, const Placed& p, int slab, int row) {
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
__device__ inline void addForm(VoxelShared& s, const Placed& p, int lane) {
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
__device__ inline void finishVoxels(const VoxelArguments& a, VoxelShared& s, float one) {
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

/// Adds the ellipsoids of a list to the window, each by a team of kLanes threads.
__device__ inline void addList(const VoxelArguments& a, VoxelShared& s, const std::uint32_t* ids,
                               std::uint32_t n, float unitsOfOne) {
  const int lane = int(threadIdx.x) % kLanes;
  for (std::uint32_t i = threadIdx.x / kLanes; i < n; i += kTeams)
    addForm(s, placedIn(a, s.pass, ids[i], unitsOfOne), lane);
}

}  // namespace esvr::cuda
