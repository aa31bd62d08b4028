#pragma once
/// Adds an ellipsoid to the voxels of a window, row by row. The code is compiled for host and
/// device.
///
/// The slab, row and column of a voxel are its coordinates along the three axes, in an order that
/// depends on the window. Let d = x - center, and let L = S^-1 R^T = Q U be a QR decomposition with
/// an upper triangular U whose rows and columns are in the order column, row, slab. Then
///
///     m = |L d|^2 = (cc dc + cr dr + cs ds)^2 + (rr dr + rs ds)^2 + (ss ds)^2
///
/// The last square alone decides which slabs the support (m < cutoff) meets, the last two decide
/// which rows of a slab, and all three decide which voxels of a row. No term is negative, so there
/// is no cancellation, and float32 is precise enough for very thin ellipsoids too. U is computed in
/// float64.

#include <array>
#include <cstdint>

#include "render/ray_math.h"
#include "render/whole.h"

namespace esvr {

/// The axes (0, 1, 2 for x, y, z) that slab, row and column coordinates count along.
struct WindowAxes {
  int slab, row, column;
};
/// The axes for a given slab axis. The other two keep their order.
ESVR_HD inline WindowAxes axesOfSlabs(int slab) {
  return {slab, slab == 0 ? 1 : 0, slab == 2 ? 1 : 2};
}

/// The entries of U for one choice of the slab axis.
struct alignas(16) WindowOrder {
  float cc, cr, cs, rr, rs, ss;
  float slabs;  ///< half extent of the support along the slab axis
};

/// The constants of RayKernel; gain and base are numerator and base times the intensity.
struct alignas(16) WindowKernel {
  float gain, base, plateau, shift, cutoff;
  float bound;  ///< |intensity|, which no value exceeds
};

/// An ellipsoid in the form for windows.
struct alignas(16) WindowForm {
  float center[3];  ///< relative to the origin of its chunk
  std::uint32_t chunk;
  WindowOrder order[3];  ///< indexed by the slab axis
  WindowKernel kernel;
};
static_assert(sizeof(WindowForm) == 144);

/// The voxels of a row that lie in a support: columns `first` to `last`, none if last < first. At
/// column i the exponent in the kernel is, in base 2, nearest + speed (i - middle)^2.
struct WindowRun {
  int first, last;
  float middle, nearest, speed;
};

/// A row of voxels, and the range of columns to which the run is limited.
struct WindowRow {
  float slab, row;  ///< relative to the ellipsoid's center
  float centerColumn;
  int firstColumn, lastColumn;
};

/// The rows that a support meets in a slab, relative to its center; none if low > high.
struct WindowExtent {
  float low, high;
};
/// \param slab  relative to the ellipsoid's center
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

/// The value intensity * phi at a column of the run.
ESVR_HD inline float valueAt(const WindowKernel& k, const WindowRun& run, int column) {
  const float t = float(column) - run.middle;
  return k.gain / (k.plateau + std::exp2(run.nearest + run.speed * t * t)) - k.base;
}

}  // namespace esvr
