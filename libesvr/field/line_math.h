#pragma once
/// The math of a LineForm for each voxel, which gives m. The code serves SIMD vectors and CUDA: T
/// is float or a vector of floats, and so is X, the type of dx, which is the same for all voxels of
/// a line.
///
/// The functions are static, so that each translation unit keeps its own copy for its instruction
/// set. Otherwise the linker could keep one copy for all of them.

#include "esvr/kernel.h"
#include "field/line_form.h"

namespace esvr {

/// m at the point of the line (dx, dz) that is closest to the center. No voxel of the line has a
/// smaller m.
/// \param pzDz  pz * dz
template <class T, class X>
ESVR_HD static inline T closestSquared(const LineForm& f, X dx, const T (&pzDz)[3]) {
  const T u0 = pzDz[0] + dx * f.px[0], u1 = pzDz[1] + dx * f.px[1], u2 = pzDz[2] + dx * f.px[2];
  return u0 * u0 + u1 * u1 + u2 * u2;
}

/// The distance t from the closest point to y.
/// \param centerY  y of the center, in the frame of y
template <class T, class X>
ESVR_HD static inline T distanceAlong(const LineForm& f, T y, float centerY, X dx, T dz) {
  return y - (dx * f.sx + centerY) - dz * f.sz;
}

/// m at t. \param closest  m at the closest point
template <class T>
ESVR_HD static inline T squaredAt(const LineForm& f, T closest, T t) {
  return closest + f.a * t * t;
}

}  // namespace esvr
