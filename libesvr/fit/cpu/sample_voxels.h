#pragma once
/// Samples voxels in proportion to their squared residual.

#include <vector>

#include "fit/residual_field.h"
#include "fit/sampling_options.h"

namespace esvr {

struct SampledVoxels {
  std::vector<Coord> voxels;  ///< distinct voxels
  double share = 0.0;         ///< energy for each draw
};

/// Systematic sampling in the order of the bricks: the total energy is divided into `count` equal
/// shares, and one voxel is drawn from each. A voxel that covers several shares is drawn once. The
/// result is empty if seeds cannot reduce any residual.
[[nodiscard]] SampledVoxels sampleVoxels(const ResidualField& residual,
                                         const SamplingOptions& options);

}  // namespace esvr
