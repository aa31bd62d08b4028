#pragma once
/// Clones and splits ellipsoids with large gradients (3D Gaussian Splatting, section 5.2).

#include <cstddef>
#include <cstdint>

#include "fit/paper/paper_ellipsoid.h"

namespace esvr::paper {

struct DensifyRule {
  double threshold = 0.0;    ///< see PaperMethod::gradientThreshold
  double splitAbove = 0.0;   ///< scale in voxels above which ellipsoids are split, not cloned
  std::size_t maxCount = 0;  ///< largest number of ellipsoids; large gradients have precedence
  std::uint64_t seed = 1;
};

struct DensifyCounts {
  std::size_t cloned = 0, split = 0;
};

/// Mean length of the gradients by position since the last densification; 0 without visits.
[[nodiscard]] double meanGradient(const PaperState& state);

/// Clones or splits the ellipsoids whose gradient reaches the threshold. A clone has the position
/// of its original, and each of the two has half the intensity, so the field does not change. A
/// split ellipsoid is replaced by two of the same intensity and 1.6 times smaller scales, at
/// positions that are drawn from a normal distribution with its scales. New ellipsoids start
/// without momentum. All gradient sums are reset.
DensifyCounts densify(Population& population, const DensifyRule& rule);

}  // namespace esvr::paper
