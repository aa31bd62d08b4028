#pragma once
/// Draws voxels in proportion to their squared residual.

#include <vector>

#include "fit/draw_options.h"
#include "fit/residual_field.h"

namespace esvr {

/// Systematic sampling along the bricks' order: `count` equal shares of the total energy, one voxel
/// from each, so that draws spread evenly. Fewer, or none, where no residual can be mended.
[[nodiscard]] std::vector<Coord> drawVoxels(const ResidualField& residual,
                                            const DrawOptions& options);

}  // namespace esvr
