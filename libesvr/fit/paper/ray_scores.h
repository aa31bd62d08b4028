#pragma once
/// Scores of ellipsoids by the rays of pictures, as LightGaussian (Fan et al. 2024) has them.

#include <span>
#include <vector>

#include "fit/paper/prune.h"

namespace esvr::paper {

/// Number of views of the paper's comparison with LightGaussian.
inline constexpr int kRayViews = 360;

/// For each ellipsoid, the sum over the rays of all views of its opacity, times the transmittance of
/// the ellipsoids in front of it. Views are evenly distributed over the sphere; their rays are
/// parallel and one voxel apart. The opacity is the largest |I| phi along the ray in units of 255
/// floors, at most 0.99, and 0 below the floor. Ellipsoids are ordered by the depths of their
/// centers, as in 3D Gaussian Splatting. The result does not depend on the number of threads.
[[nodiscard]] std::vector<double> rayContributions(std::span<const PaperEllipsoid> ellipsoids,
                                                   const CoverageOptions& options,
                                                   int views = kRayViews);

}  // namespace esvr::paper
