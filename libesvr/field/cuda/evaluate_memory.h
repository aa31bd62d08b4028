#pragma once
/// What an evaluation keeps in device memory.

#include "core/cuda/device_buffer.h"
#include "field/cuda/batches.h"
#include "field/cuda/evaluate_launch.h"
#include "field/evaluate_plan.h"

namespace esvr::cuda {

/// The ellipsoids; serves any number of batches.
struct DeviceField {
  DeviceField(const GatheredField& field, cudaStream_t stream);

  DeviceBuffer<LineForm> forms;
  DeviceBuffer<std::uint32_t> chunkOf;
  DeviceBuffer<Coord> origins;
  KernelConstants<float> kernel{};
  DeviceBuffer<KernelConstants<float>> ownKernels;
};

/// One batch of bricks.
struct DeviceBricks {
  DeviceBricks(const BrickPairs& pairs, std::span<const Coord> corners, Batch batch,
               cudaStream_t stream);
  /// Bytes that the members below come to.
  static constexpr BrickCost kCost{
      .perBrick = sizeof(Coord) + sizeof(std::uint32_t) + kBrickVoxels * sizeof(float),
      .perPair = sizeof(std::uint32_t)};

  std::uint32_t firstPair;
  DeviceBuffer<Coord> corners;
  DeviceBuffer<std::uint32_t> brickBegin;
  DeviceBuffer<std::uint32_t> ellipsoid;
  DeviceBuffer<float> values;
};

[[nodiscard]] EvaluateArguments evaluateArguments(const DeviceField& field, DeviceBricks& bricks,
                                                  float background);

}  // namespace esvr::cuda
