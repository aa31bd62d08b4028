#pragma once
/// An ellipsoid in the form that the passes over bricks read.

#include "fit/ellipsoid.h"
#include "fit/frame.h"

namespace esvr::cuda {

struct alignas(16) PairForm {
  LineForm form;
  Coord frame;  ///< voxel that the form's center is relative to
  float halfZ;  ///< half width of the support's bounding box along z
};

#if defined(__CUDACC__)
__device__ inline PairForm pairForm(const Ellipsoid& p, double radius) {
  const Coord frame = frameOf(p.center);
  const Matrix3 F = inverse(p.L);
  const auto center = inFrame(p.center, frame);
  return {makeLineForm(center, p.L, radius, p.intensity), frame,
          float(radius * std::sqrt(sigma(F, 2, 2)))};
}
#endif

}  // namespace esvr::cuda
