#pragma once
/// The per-voxel math of a LineForm, written once for the CPU's vectors and for CUDA: T is float or
/// a vector of floats. phi of what comes out is in esvr/kernel.h.
///
/// Functions are static: every instruction set's translation unit must keep its own copy, since the
/// linker would be free to keep one of them for all.

#include "esvr/kernel.h"
#include "field/line_form.h"

namespace esvr {

/// m at the closest approach of the line at (dx, dz); no voxel of the line has a smaller m.
/// \param pzDz  pz times dz
template <class T>
ESVR_HD static inline T closestSquared(const LineForm& f, float dx, const T (&pzDz)[3]) {
  const T u0 = pzDz[0] + f.px[0] * dx, u1 = pzDz[1] + f.px[1] * dx, u2 = pzDz[2] + f.px[2] * dx;
  return u0 * u0 + u1 * u1 + u2 * u2;
}

/// t: how far y lies beyond the closest approach.
/// \param centerY  the center's y in the frame of y
template <class T>
ESVR_HD static inline T distanceAlong(const LineForm& f, T y, float centerY, float dx, T dz) {
  return y - (centerY + f.sx * dx) - dz * f.sz;
}

/// m at t, from m at the closest approach.
template <class T>
ESVR_HD static inline T squaredAt(const LineForm& f, T closest, T t) {
  return closest + f.a * t * t;
}

}  // namespace esvr
