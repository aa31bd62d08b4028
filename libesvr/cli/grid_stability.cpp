#include "cli/grid_stability.h"

#include <algorithm>
#include <cmath>

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

double largestMagnitude(const StoredGrid& grid) {
  return std::max({std::abs(double(grid.valueMin)), std::abs(double(grid.valueMax)),
                   std::abs(double(grid.field.background))});
}

}  // namespace esvr::cli
