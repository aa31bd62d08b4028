#pragma once
/// Clones and splits ellipsoids with large gradients (3D Gaussian Splatting, section 5.2).

#include <cstddef>
#include <cstdint>

#include "fit/paper/paper_ellipsoid.h"

namespace esvr::paper {

struct DensifyRule {
  double threshold = 0.0;    ///< of the mean gradient by position (PaperMethod::gradientThreshold)
  double splitAbove = 0.0;   ///< voxels: larger scales are split, others cloned
  std::size_t maxCount = 0;  ///< ellipsoids; where more would come, the largest gradients go first
  std::uint64_t seed = 1;
};

struct DensifyCounts {
  std::size_t cloned = 0, split = 0;
};

/// Mean length of the gradients by position since the last densification; 0 where none was seen.
[[nodiscard]] double meanGradient(const PaperState& state);

/// A clone stands where its original does, with half the intensity each: the field stays. Of a
/// split, two of the same intensity come in its place, drawn from a normal distribution with its
/// scales, 1.6 times smaller. New ones begin without momentum. Afterwards no gradient is
/// remembered.
DensifyCounts densify(Population& population, const DensifyRule& rule);

}  // namespace esvr::paper
