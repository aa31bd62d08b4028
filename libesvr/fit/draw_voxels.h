#pragma once
/// Draws voxels in proportion to their squared residual.

#include <vector>

#include "fit/draw_options.h"
#include "fit/residual_field.h"

namespace esvr {

struct DrawnVoxels {
  std::vector<Coord> voxels;  ///< each once
  double share = 0.0;         ///< energy that each draw stood for
};

/// Systematic sampling along the bricks' order: `count` equal shares of the total energy, one voxel
/// from each, so that draws spread evenly. A voxel that holds several shares is drawn once; none is
/// where no residual can be mended.
[[nodiscard]] DrawnVoxels drawVoxels(const ResidualField& residual, const DrawOptions& options);

}  // namespace esvr
