#pragma once
/// The initial ellipsoids of the paper's method.

#include "fit/paper/paper_ellipsoid.h"
#include "fit/target.h"

namespace esvr::paper {

/// Makes spheres on distinct voxels that differ from the background, drawn evenly in the order of
/// the bricks: `points` of them, or one for each such voxel if there are fewer. They reach three
/// times as far as the distance that they would have if they were spread evenly. Their intensity is the
/// voxel's value divided by the overlap of the spheres.
[[nodiscard]] std::vector<PaperEllipsoid> initialPoints(const FitTarget& target, std::size_t points,
                                                        const KernelKind& kind, std::uint64_t seed);

}  // namespace esvr::paper
