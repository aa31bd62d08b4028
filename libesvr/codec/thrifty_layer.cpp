#include <algorithm>
#include <cmath>

#include "codec/brick_order.h"
#include "codec/voxel_coder.h"
#include "codec/voxel_model.h"
#include "esvr/voxel_layer.h"

namespace esvr {

VoxelLayer thriftyLayer(const SparseVolume& volume, VoxelLayer layer, double bitPrice) {
  if (layer.form != VoxelForm::kQuantised) return layer;
  codec::Thrift thrift{std::vector<double>(layer.codes.size()), bitPrice};
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    const auto at = findBrick(volume, layer.bricks[b]);
    const auto values = volume.brickValues(*at);
    double* exact = &thrift.exact[b * std::size_t(kBrickVoxels)];
    for (std::size_t v = 0; v < kBrickVoxels; ++v) exact[v] = double(values[v]) * layer.divisor;
  }
  codec::chooseCodes(codec::codingOrder(layer.bricks), codec::chooseModel(layer), thrift, layer);
  return layer;
}

}  // namespace esvr
