#pragma once
/// Draws voxels in proportion to their squared residual.

#include <vector>

#include "fit/residual_field.h"
#include "fit/sampling_options.h"

namespace esvr {

struct SampledVoxels {
  std::vector<Coord> voxels;  ///< each once
  double share = 0.0;         ///< energy that each draw stood for
};

/// Systematic sampling along the bricks' order: `count` equal shares of the total energy, one voxel
/// from each, so that draws spread evenly. A voxel that holds several shares is drawn once; none is
/// where no residual can be mended.
[[nodiscard]] SampledVoxels sampleVoxels(const ResidualField& residual,
                                         const SamplingOptions& options);

}  // namespace esvr
