#pragma once
/// The supports of primitives, as the kernels that build lists need them.

#include <cstddef>

#include "fit/primitive.h"

namespace esvr::cuda {

struct SupportSource {
  const Primitive* primitives;
  std::size_t count;
  double radius;                  ///< of the support in the unit frame
  double slack;                   ///< voxels by which supports are widened
  const double* radii = nullptr;  ///< a primitive's; null: all have `radius`

  [[nodiscard]] ESVR_HD double radiusOf(std::size_t i) const {
    return radii != nullptr ? radii[i] : radius;
  }
};

}  // namespace esvr::cuda
