#pragma once
/// Scores ellipsoids and removes the least (paper, section 3.2.2).

#include <span>
#include <vector>

#include "esvr/coord.h"
#include "esvr/paper_method.h"
#include "fit/paper/paper_ellipsoid.h"

namespace esvr::paper {

/// Fractional anisotropy of Sigma (paper, eq. fa): 0 for a sphere, 1 for a line.
[[nodiscard]] double fractionalAnisotropy(const std::array<double, 3>& logScale);

/// What an ellipsoid covers of a volume.
struct Coverage {
  double voxels = 0.0;        ///< where |I| phi is at least the floor
  double contribution = 0.0;  ///< sum of |I| phi there
};

struct CoverageOptions {
  KernelKind kind;
  Box box;             ///< voxels of the volume, relative to its origin
  double floor = 0.0;  ///< in units of the intensities
};

/// By the definition, in float64 at every voxel.
[[nodiscard]] Coverage coverageOf(const PaperEllipsoid& ellipsoid, const CoverageOptions& options);

/// Scores of all, in their order.
[[nodiscard]] std::vector<double> pruneScores(std::span<const PaperEllipsoid> ellipsoids,
                                              PruneScore score, const CoverageOptions& options);

/// Keeps the `keep` ellipsoids of the highest scores, the earlier of equal ones, in their order.
void keepHighest(Population& population, std::span<const double> scores, std::size_t keep);

}  // namespace esvr::paper
