#pragma once
/// Adds an ellipsoid to voxels, line by line; written once for host and device.
///
/// Voxels are counted in slabs across one axis, rows across a second, columns along the third. With
/// d = x - center and L = S^-1 R^T = Q U, U upper triangular in the order column, row, slab,
///
///     m = |L d|^2 = (cc dc + cr dr + cs ds)^2 + (rr dr + rs ds)^2 + (ss ds)^2 :
///
/// the last square alone says which slabs the support meets, the last two which rows of a slab, all
/// three which voxels of a row. Nothing cancels, so float32 holds for needles and pancakes too. U
/// is computed in float64.

#include <array>
#include <cstdint>

#include "render/ray_math.h"
#include "render/whole.h"

namespace esvr {

/// The axes of voxels' slabs, rows and columns; the slabs' comes first, the others in order.
struct WindowAxes {
  int slab, row, column;
};
ESVR_HD inline WindowAxes axesOfSlabs(int slab) {
  return {slab, slab == 0 ? 1 : 0, slab == 2 ? 1 : 2};
}

/// U, and how far the support reaches from the center across slabs.
struct alignas(16) WindowOrder {
  float cc, cr, cs, rr, rs, ss;
  float slabs;
};

/// The kernel, as RayKernel has it, times the intensity.
struct alignas(16) WindowKernel {
  float gain, base, plateau, shift, cutoff;
  float bound;  ///< no value is further from 0
};

struct alignas(16) WindowForm {
  float center[3];  ///< relative to its chunk's origin
  std::uint32_t chunk;
  WindowOrder order[3];  ///< by the axis of the slabs
  WindowKernel kernel;
};
static_assert(sizeof(WindowForm) == 144);

/// The voxels of a row that a support holds: from `first` to `last`, none where last is less. In
/// base 2 the exponent at column i is `nearest` + `speed` (i - `middle`)^2.
struct WindowRun {
  int first, last;
  float middle, nearest, speed;
};

/// A row's place and the columns that are wanted. All count from one voxel, as `center` does.
struct WindowRow {
  float slab, row;  ///< from the center
  float centerColumn;
  int firstColumn, lastColumn;
};

/// Rows that the support meets in a slab, from the center; low > high where none.
struct WindowExtent {
  float low, high;
};
/// \param slab  from the center
ESVR_HD inline WindowExtent rowsOf(const WindowKernel& k, const WindowOrder& o, float slab) {
  const float ofSlab = o.ss * slab, left = k.cutoff - ofSlab * ofSlab;
  if (!(left > 0.0f)) return {1.0f, -1.0f};
  const float inverse = 1.0f / o.rr, middle = -o.rs * slab * inverse;
  const float half = std::sqrt(left) * inverse;
  return {middle - half, middle + half};
}

ESVR_HD inline WindowRun runOn(const WindowKernel& k, const WindowOrder& o, const WindowRow& at) {
  using namespace ray_math;
  const float ofSlab = o.ss * at.slab, ofRow = o.rr * at.row + o.rs * at.slab;
  const float nearest = ofSlab * ofSlab + ofRow * ofRow;
  if (!(nearest < k.cutoff)) return {0, -1, 0.0f, 0.0f, 0.0f};
  const float inverse = 1.0f / o.cc;
  const float middle = at.centerColumn - (o.cr * at.row + o.cs * at.slab) * inverse;
  const float half = std::sqrt(k.cutoff - nearest) * inverse;
  const WholeRange columns =
      wholeWithin(middle - half, middle + half, {at.firstColumn, at.lastColumn});
  return {columns.first, columns.last, middle, nearest * kLog2e - k.shift, o.cc * o.cc * kLog2e};
}

/// intensity * phi at a column of the run.
ESVR_HD inline float valueAt(const WindowKernel& k, const WindowRun& run, int column) {
  const float t = float(column) - run.middle;
  return k.gain / (k.plateau + std::exp2(run.nearest + run.speed * t * t)) - k.base;
}

}  // namespace esvr
