#include "vdb2esvr/source.h"

#include "esvr/vector_metrics.h"

namespace esvr::vdb2esvr {

VolumeGrid readSource(const Options& options, const FittedGrid& grid) {
  return grid.component ? readComponent(options.input, grid.place, *grid.component, options.read)
                        : readGrid(options.input, grid.place, options.read);
}

void findPeaks(const Options& options, std::vector<FittedGrid>& grids) {
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (!grids[g].component) continue;
    grids[g].peak =
        grids[g].component == std::size_t{0}
            ? peakOfVectors(readVector(options.input, grids[g].place, options.read).components)
            : grids[g - 1].peak;
  }
}

}  // namespace esvr::vdb2esvr
