#pragma once
/// Pruning: scores ellipsoids and removes those of lowest score (paper, section 3.2.2).

#include <span>
#include <vector>

#include "esvr/coord.h"
#include "esvr/paper_method.h"
#include "fit/paper/paper_ellipsoid.h"

namespace esvr::paper {

/// Fractional anisotropy of Sigma: 0 for a sphere, 1 for a line.
[[nodiscard]] double fractionalAnisotropy(const std::array<double, 3>& logScale);

/// The part of a volume that an ellipsoid covers.
struct Coverage {
  double voxels = 0.0;        ///< number of voxels at which |I| phi is at least the floor
  double contribution = 0.0;  ///< sum of |I| phi over these voxels
};

struct CoverageOptions {
  KernelKind kind;
  Box box;             ///< voxels of the volume, relative to its origin
  double floor = 0.0;  ///< smallest |I| phi that covers a voxel, units of the intensities
};

/// Evaluates the definition in float64 at every voxel.
[[nodiscard]] Coverage coverageOf(const PaperEllipsoid& ellipsoid, const CoverageOptions& options);

/// The scores of all ellipsoids, in their order.
[[nodiscard]] std::vector<double> pruneScores(std::span<const PaperEllipsoid> ellipsoids,
                                              PruneScore score, const CoverageOptions& options);

/// Keeps the `keep` ellipsoids of highest score, in their order. Of equal scores, the first ones
/// are kept.
void keepHighest(Population& population, std::span<const double> scores, std::size_t keep);

}  // namespace esvr::paper
