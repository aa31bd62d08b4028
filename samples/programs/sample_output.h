#pragma once
/// What the sample programs may make, and how they write it.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/vdb_io.h"
#include "programs/resources.h"
#include "programs/run_main.h"

namespace esvr::samples {

/// Memory of a brick until it is written: 2124 bytes in the SparseVolume and the search for it, and
/// the same amount for OpenVDB's leaf and its compressed form.
inline constexpr std::uint64_t kBytesPerBrick = 4500;

/// The number of bricks that fit into three quarters of the machine's memory.
inline std::uint64_t bricksThatFit() { return cli::physicalMemory() / 4 * 3 / kBytesPerBrick; }

struct Output {
  std::filesystem::path path;
  bool overwrite = false;
};

/// Writes the grids and logs them. \throws BadInput  a grid has no active voxel
inline void writeOutput(const Output& output, std::span<const MetaItem> metadata,
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
