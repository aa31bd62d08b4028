#include "vdb2esvr/source.h"

#include "esvr/vector_metrics.h"

namespace esvr::vdb2esvr {

VolumeGrid readSource(const Options& options, const FittedGrid& grid) {
  const std::string& name = grid.source.uniqueName;
  return grid.component ? readComponent(options.input, name, *grid.component, options.read)
                        : readGrid(options.input, name, options.read);
}

void findScales(const Options& options, std::vector<FittedGrid>& grids) {
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (!grids[g].component) continue;
    if (grids[g].component != std::size_t{0}) {
      grids[g].peak = grids[g - 1].peak, grids[g].range = grids[g - 1].range;
      continue;
    }
    const VectorGrid vectors = readVector(options.input, grids[g].source.uniqueName, options.read);
    grids[g].peak = peakOfVectors(vectors.components);
    grids[g].range = valueRangeOfVectors(vectors.components);
  }
}

}  // namespace esvr::vdb2esvr
