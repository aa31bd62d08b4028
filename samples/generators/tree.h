#pragma once
/// Branching vessels.

#include <vector>

#include "esvr/sparse_volume.h"
#include "generators/sample_options.h"
#include "generators/tubes.h"

namespace esvr::samples {

/// The tubes of the tree, whose longest side is `resolution` voxels. The tree is the same for every
/// resolution, except that no tube is thinner than kThinnestTube.
[[nodiscard]] std::vector<Tube> treeTubes(const SampleOptions& options);

[[nodiscard]] SparseVolume makeTree(const SampleOptions& options);

inline constexpr double kThinnestTube =
    0.75;  ///< smallest radius in voxels; thinner tubes would have gaps

}  // namespace esvr::samples
