#include "field/cuda/evaluate_memory.h"

namespace esvr::cuda {

DeviceField::DeviceField(const GatheredField& field, cudaStream_t stream)
    : forms(field.forms, stream), chunkOf(field.chunkOf, stream), origins(field.origins, stream) {
  if (field.kernels.size() == 1)
    kernel = field.kernels.front();
  else
    ownKernels = {field.kernels, stream};
}

DeviceBricks::DeviceBricks(const BrickPairs& pairs, std::span<const Coord> allCorners, Batch batch,
                           cudaStream_t stream)
    : firstPair(pairs.brickBegin[batch.begin]),
      corners(allCorners.subspan(batch.begin, batch.end - batch.begin), stream),
      brickBegin(std::span(pairs.brickBegin).subspan(batch.begin, corners.size() + 1), stream),
      ellipsoid(
          std::span(pairs.ellipsoid).subspan(firstPair, pairs.brickBegin[batch.end] - firstPair),
          stream),
      values(corners.size() * kBrickVoxels, stream) {}

EvaluateArguments evaluateArguments(const DeviceField& field, DeviceBricks& bricks,
                                    float background) {
  return {.forms = field.forms.data(),
          .chunkOf = field.chunkOf.data(),
          .origins = field.origins.data(),
          .kernel = field.kernel,
          .ownKernels = field.ownKernels.data(),
          .bricks = std::uint32_t(bricks.corners.size()),
          .corners = bricks.corners.data(),
          .brickBegin = bricks.brickBegin.data(),
          .firstPair = bricks.firstPair,
          .ellipsoid = bricks.ellipsoid.data(),
          .background = background,
          .values = bricks.values.data()};
}

}  // namespace esvr::cuda
