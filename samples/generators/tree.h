#pragma once
/// Branching vessels.

#include <vector>

#include "esvr/sparse_volume.h"
#include "generators/sample_options.h"
#include "generators/tubes.h"

namespace esvr::samples {

/// The tree's tubes, its longest side being `resolution` voxels. The tree is the same for every
/// resolution, but that no tube is thinner than kThinnestTube.
[[nodiscard]] std::vector<Tube> treeTubes(const SampleOptions& options);

[[nodiscard]] SparseVolume makeTree(const SampleOptions& options);

inline constexpr double kThinnestTube = 0.75;  ///< radius in voxels: thinner would break up

}  // namespace esvr::samples
