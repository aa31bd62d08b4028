#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "codec/brick_order.h"
#include "codec/frame_coder.h"
#include "codec/voxel_coder.h"
#include "core/parallel.h"
#include "esvr/voxel_layer.h"

namespace esvr {

namespace {

/// The voxels of a volume in units of the lattice, in the order of the layer's codes.
std::vector<double> placesOf(const SparseVolume& volume, const VoxelLayer& layer) {
  std::vector<double> places(layer.codes.size());
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    throwIfCancelled();
    const auto values = volume.brickValues(*findBrick(volume, layer.bricks[b]));
    double* place = &places[b * std::size_t(kBrickVoxels)];
    for (std::size_t v = 0; v < kBrickVoxels; ++v) place[v] = double(values[v]) * layer.divisor;
  }
  return places;
}

/// The bytes of all bricks, if a part of them took more than a limit.
std::optional<std::uint64_t> extrapolated(const codec::CodedPart& part, std::size_t bricks,
                                          std::uint64_t mostBytes) {
  if (part.bytes <= mostBytes) return std::nullopt;
  return std::uint64_t(double(part.bytes) * double(bricks) / double(part.bricks));
}

}  // namespace

ThriftyLayer thriftyLayer(const SparseVolume& volume, VoxelLayer layer,
                          const ThriftOptions& options) {
  if (layer.form != VoxelForm::kQuantised) return {std::move(layer)};
  if (options.previous && codec::isPredictable(layer, *options.previous)) {
    const codec::FrameThrift thrift{placesOf(volume, layer), options.bitPrice, options.steadiness,
                                    options.signs};
    codec::chooseFrameCodes(codec::codingOrder(layer.bricks),
                            codec::PastVoxels(*options.previous, layer), thrift, layer);
    return {std::move(layer)};
  }
  const codec::Thrift thrift{placesOf(volume, layer), options.bitPrice, options.signs};
  const codec::CodedPart part =
      codec::chooseCodes(codec::chooseModel(layer), thrift, options.mostBytes, layer);
  const auto tooMany = extrapolated(part, layer.bricks.size(), options.mostBytes);
  return {std::move(layer), tooMany};
}

}  // namespace esvr
