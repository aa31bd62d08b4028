#include <algorithm>

#include "esvr/grid_coding.h"

namespace esvr {
namespace {

Box boxAround(const std::vector<Coord>& corners) {
  Box box;
  for (const Coord corner : corners)
    box.expand(Box{corner, corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1}});
  return box;
}

EstimateOptions optionsFor(const StoredGrid& grid, const DecodeOptions& options) {
  EstimateOptions estimate{.within = common(grid.activeBox, options.box.value_or(Box::whole())),
                           .enough = double(options.maxBytes),
                           .memory = options.memory};
  if (grid.topology == TopologyKind::kThreshold) return estimate;
  estimate.within = common(estimate.within, boxAround(grid.bricks));
  estimate.maxBricks = double(grid.bricks.size());
  return estimate;
}

}  // namespace

WorkEstimate estimateDecode(const StoredGrid& grid, const DecodeOptions& options) {
  if (grid.voxels) return {.bricks = double(grid.voxels->bricks.size())};
  WorkEstimate work = estimateWork(grid.field, optionsFor(grid, options));
  if (grid.topology != TopologyKind::kThreshold) work.bricks = double(grid.bricks.size());
  if (grid.residual) work.bricks += double(grid.residual->bricks.size());
  return work;
}

}  // namespace esvr
