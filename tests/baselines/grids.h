#pragma once
/// A grid for the tests of baselines.

#include "esvr/vdb_io.h"
#include "metrics/volumes.h"

namespace esvr::test {

/// A soft ball of radius 12 around (20, 20, 20), whose values fall from 1 to 0.
inline VolumeGrid ballGrid() {
  VolumeGrid grid;
  grid.descriptor.name = "density";
  grid.descriptor.gridClass = GridClass::kFogVolume;
  grid.descriptor.transform = uniformTransform(0.5);
  std::vector<Voxel> voxels;
  for (int x = 8; x <= 32; ++x)
    for (int y = 8; y <= 32; ++y)
      for (int z = 8; z <= 32; ++z) {
        const int r2 = (x - 20) * (x - 20) + (y - 20) * (y - 20) + (z - 20) * (z - 20);
        if (r2 < 144) voxels.push_back({{x, y, z}, 1.0f - float(r2) / 144.0f});
      }
  grid.volume = volumeOf(voxels);
  return grid;
}

}  // namespace esvr::test
