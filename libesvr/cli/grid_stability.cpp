#include "cli/grid_stability.h"

#include "esvr/grid_coding.h"

namespace esvr::cli {

StabilityOptions stabilityOptionsOf(const StoredGrid& grid, std::size_t samples) {
  const RevoxeliseOptions rule = voxelRule(grid);
  StabilityOptions options;
  options.samples = samples;
  options.bricks = rule.bricks;
  options.within = grid.activeBox;
  options.range = rule.range;
  return options;
}

double peakOfSource(const StoredGrid& grid) {
  return peakOf({grid.valueMin, grid.valueMax}, grid.descriptor.background);
}

}  // namespace esvr::cli
