#pragma once
/// Scales tubes from their own units to voxels.

#include <span>
#include <vector>

#include "generators/tubes.h"

namespace esvr::samples {

struct TubeScale {
  int resolution = 128;     ///< voxels along the longest side of the tubes' box
  double minRadius = 0.75;  ///< voxels: thinner tubes are thickened to it
  int margin = 1;           ///< voxels kept free for soft edges below the smallest corner
};

struct ScaledTubes {
  std::vector<Tube> tubes;  ///< index coordinates, smallest corner at `margin`
  double voxelSize = 1.0;   ///< side of a voxel in the units of the tubes
  Vec3 origin;              ///< position of index (0, 0, 0) in the units of the tubes
};

/// \throws BadInput  the tubes have no extent
[[nodiscard]] ScaledTubes fitTubes(std::span<const Tube> tubes, const TubeScale& scale);

}  // namespace esvr::samples
