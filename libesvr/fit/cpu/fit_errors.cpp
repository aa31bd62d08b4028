#include "fit/cpu/fit_errors.h"

#include <algorithm>
#include <cmath>

namespace esvr {

FitErrors errorsOf(const FitTarget& target, const ResidualField& residual) {
  FitErrors errors;
  for (std::size_t b = 0; b < residual.index.size(); ++b) {
    const auto r = residual.brick(b);
    const bool inTarget = b < target.bricks.size();
    const Coord corner = residual.index.bricks()[b] * kBrickSide;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double squared = double(r[v]) * double(r[v]);
      errors.squaredSum += squared;
      if (target.box.contains(corner + voxelLocal(v))) errors.squaredSumBox += squared;
      errors.largest = std::max(errors.largest, std::abs(double(r[v])));
      if (inTarget && (*target.active)[b].test(v)) errors.squaredSumActive += squared;
    }
  }
  return errors;
}

}  // namespace esvr
