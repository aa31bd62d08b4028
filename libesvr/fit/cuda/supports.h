#pragma once
/// The supports of ellipsoids for the kernels that build lists.

#include <cstddef>

#include "field/support.h"
#include "fit/ellipsoid.h"
#include "fit/listed_support.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct SupportSource {
  const Ellipsoid* ellipsoids;
  std::size_t count;
  double radius;                  ///< radius of the supports in the unit frame
  double slack;                   ///< voxels by which supports are widened
  const double* radii = nullptr;  ///< radius of each support; null: all have `radius`
  /// If it is not null, it is read instead of `ellipsoids` and `radii`.
  const ListedSupport* listed = nullptr;

  [[nodiscard]] ESVR_HD double radiusOf(std::size_t i) const {
    return radii != nullptr ? radii[i] : radius;
  }
  [[nodiscard]] ESVR_HD Support supportOf(std::size_t i) const {
    if (listed != nullptr)
      return makeSupport(listed[i].center, listed[i].L, listed[i].reach, slack);
    return makeSupport(ellipsoids[i].center, ellipsoids[i].L, radiusOf(i), slack);
  }
};

/// \return the bricks of `within` that the support's bounding box overlaps; empty if there are
///         none. The limit keeps the search short for a support that is larger than the volume.
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
