#include "vdb2esvr/frame_memory.h"

#include <algorithm>

#include "esvr/coord.h"

namespace esvr::vdb2esvr {
namespace {

/// Memory of a conversion for each brick. On two cores, that of smoke1 took 34 KB and that of
/// aneurism 60 KB.
constexpr double kBytesPerBrick = 65536.0;

/// An OpenVDB file has the mask of a leaf twice, and does not compress it.
constexpr double kLeafBytes = 2.0 * kBrickVoxels / 8.0;

/// An upper bound on the bricks of a grid. Bricks that are no leaves belong to active tiles, whose
/// voxels are all active.
double mostBricks(const VdbSummary& file, const GridSummary& grid) {
  const double voxels = double(grid.activeVoxels);
  if (file.format != "OpenVDB") return voxels;
  return std::min(voxels, double(file.fileBytes) / kLeafBytes + voxels / kBrickVoxels);
}

}  // namespace

std::uint64_t conversionMemory(const VdbSummary& file, const GridChoice& grids) {
  double bricks = 0.0, carried = 0.0;
  for (const FittedGrid& grid : grids.fitted)
    bricks = std::max(bricks, mostBricks(file, grid.source));
  for (const NotFitted& left : grids.carried) carried += double(left.grid.storedBytes);
  // A damaged file may claim any number of voxels.
  constexpr double kMost = 1e18;
  return std::uint64_t(std::min(bricks * kBytesPerBrick + carried, kMost));
}

}  // namespace esvr::vdb2esvr
