#pragma once
/// The supports of ellipsoids, as the kernels that build lists need them.

#include <cstddef>

#include "field/support.h"
#include "fit/ellipsoid.h"
#include "fit/listed_support.h"

namespace esvr::cuda {

/// Pointers are to device memory, borrowed.
struct SupportSource {
  const Ellipsoid* ellipsoids;
  std::size_t count;
  double radius;                  ///< of the support in the unit frame
  double slack;                   ///< voxels by which supports are widened
  const double* radii = nullptr;  ///< an ellipsoid's; null: all have `radius`
  const ListedSupport* listed =
      nullptr;  ///< where it is not null, ellipsoids and radii are not read

  [[nodiscard]] ESVR_HD double radiusOf(std::size_t i) const {
    return radii != nullptr ? radii[i] : radius;
  }
  [[nodiscard]] ESVR_HD Support supportOf(std::size_t i) const {
    if (listed != nullptr)
      return makeSupport(listed[i].center, listed[i].L, listed[i].reach, slack);
    return makeSupport(ellipsoids[i].center, ellipsoids[i].L, radiusOf(i), slack);
  }
};

/// \return the bricks of `within` that a support's bounding box overlaps: an ellipsoid over
///         everything is looked for only where bricks can be. Empty where there are none.
[[nodiscard]] ESVR_HD inline Box clippedRange(const Support& support, const Box& within) {
  const Box range = brickRange(support);
  const auto larger = [](std::int32_t a, std::int32_t b) { return a > b ? a : b; };
  const auto smaller = [](std::int32_t a, std::int32_t b) { return a < b ? a : b; };
  return {{larger(range.min.x, within.min.x), larger(range.min.y, within.min.y),
           larger(range.min.z, within.min.z)},
          {smaller(range.max.x, within.max.x), smaller(range.max.y, within.max.y),
           smaller(range.max.z, within.max.z)}};
}

}  // namespace esvr::cuda
