#pragma once
/// Where the paper's method begins.

#include "fit/paper/paper_ellipsoid.h"
#include "fit/target.h"

namespace esvr::paper {

/// Spheres on voxels that differ from the background, drawn evenly from all of them in the bricks'
/// order and none twice: as many as asked for, or as there are such voxels. Their scale is the
/// distance of neighbours if they were spread evenly, their intensity the voxel's share where so
/// many overlap.
[[nodiscard]] std::vector<PaperEllipsoid> initialPoints(const FitTarget& target, std::size_t points,
                                                        const KernelKind& kind, std::uint64_t seed);

}  // namespace esvr::paper
