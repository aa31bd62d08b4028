#include "programs/write_output.h"

#include <string>

#include "esvr/error.h"
#include "esvr/grid_names.h"

namespace esvr::samples {

void writeOutput(const Output& output, std::span<const MetaItem> metadata,
                 std::span<const VolumeGrid> grids, const cli::Log& log) {
  for (const VolumeGrid& grid : grids)
    if (grid.volume.brickCount() == 0)
      throw BadInput("grid '" + shownName(grid.descriptor.name) +
                     "' has no active voxel; nothing was written");
  writeGrids(output.path, metadata, grids, {.overwrite = output.overwrite});
  for (const VolumeGrid& grid : grids) {
    const Box box = activeBox(grid.volume);
    log.info(output.path.string() + ": " + grid.descriptor.name + ", " +
             std::to_string(activeVoxelCount(grid.volume)) + " active voxels from " +
             toString(box.min) + " to " + toString(box.max));
  }
}

}  // namespace esvr::samples
