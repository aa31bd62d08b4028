#pragma once
/// The supports of ellipsoids, as the kernels that build lists need them.

#include <cstddef>

#include "fit/ellipsoid.h"

namespace esvr::cuda {

struct SupportSource {
  const Ellipsoid* ellipsoids;
  std::size_t count;
  double radius;                  ///< of the support in the unit frame
  double slack;                   ///< voxels by which supports are widened
  const double* radii = nullptr;  ///< an ellipsoid's; null: all have `radius`

  [[nodiscard]] ESVR_HD double radiusOf(std::size_t i) const {
    return radii != nullptr ? radii[i] : radius;
  }
};

}  // namespace esvr::cuda
