#include "compact/measure_layers.h"

#include "esvr/compact.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {

std::vector<LayerError> measureLayers(const StoredGrid& grid, const SparseVolume& source,
                                      const CompareOptions& options) {
  std::vector<LayerError> errors;
  const std::size_t layers = layerCount(grid);
  for (std::size_t k = 1; k <= layers && layers > 1; ++k) {
    const auto metrics = compareVolumes(
        source, decodeGrid(firstLayers(grid, k), {.memory = memoryOf(source)}), options);
    errors.push_back({float(metrics.psnrBox), float(metrics.maxError)});
  }
  return errors;
}

}  // namespace esvr
