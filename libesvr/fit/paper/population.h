#pragma once
/// What the paper's method does with all of its ellipsoids between two epochs: it places, densifies,
/// scores and prunes them, and makes a Field of them.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/paper_method.h"
#include "fit/paper/paper_ellipsoid.h"
#include "fit/target.h"

namespace esvr::paper {

/// Makes spheres on distinct voxels that differ from the background, drawn evenly in the order of
/// the bricks: `points` of them, or one for each such voxel if there are fewer. They reach three
/// times as far as the distance that they would have if they were spread evenly. Their intensity is the
/// voxel's value divided by the overlap of the spheres.
[[nodiscard]] std::vector<PaperEllipsoid> initialPoints(const FitTarget& target, std::size_t points,
                                                        const KernelKind& kind, std::uint64_t seed);

/// Clones and splits ellipsoids with large gradients (3D Gaussian Splatting, section 5.2).
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

/// Drops ellipsoids that contribute to no voxel of a box.
void dropUnseen(Population& population, const KernelKind& kind, const Box& box);

/// \param frame  a frame whose kernel and kappas are replaced by those of `kind`
[[nodiscard]] Field fieldOf(const Population& population, const KernelKind& kind,
                            ExportFrame frame);

}  // namespace esvr::paper
