#pragma once
/// IntensityPasses on a GPU. Every pass computes phi again, which is faster there than reading it
/// from memory.

#include "core/cuda/memory_pool.h"
#include "core/cuda/stream.h"
#include "fit/cuda/brick_table.h"
#include "fit/cuda/intensity_pass.h"
#include "fit/cuda/pair_lists.h"

namespace esvr::cuda {

class CudaIntensityPasses final : public IntensityPasses {
 public:
  /// The device must be the current one.
  explicit CudaIntensityPasses(const IntensityTarget& target);

  void setShapes(const Field& field) override;
  [[nodiscard]] StoredError error(std::span<const float> intensities) override;
  StoredError gradient(std::span<const float> intensities, IntensityGradient& out) override;
  void applyNormal(std::span<const double> direction, std::vector<double>& out) override;

 private:
  [[nodiscard]] IntensityPassArguments arguments(std::span<const float> heights);
  [[nodiscard]] StoredError totalError();
  void sumPairs(std::vector<double>* rPhi, std::vector<double>* phi2);

  Coord origin_;  ///< origin of the bricks' frame
  float sourceBackground_, fieldBackground_ = 0.0f;
  VoxelRule stored_;
  Box box_;
  bool restricted_;
  KernelConstants<float> kernel_{};
  std::size_t count_ = 0;  ///< number of ellipsoids
  KeepFreedMemory keep_;
  Stream stream_;
  BrickTable bricks_;
  PairLists lists_;
  DeviceBuffer<float> source_;
  GrowingBuffer<Ellipsoid> ellipsoids_;
  GrowingBuffer<PairForm> forms_;
  GrowingBuffer<float> heights_;
  GrowingBuffer<StoredError> errors_;
  GrowingBuffer<std::uint32_t> exact_;
  GrowingBuffer<PairProjection> projections_;
  GrowingBuffer<double> sums_;
  std::vector<StoredError> brickErrors_;
};

}  // namespace esvr::cuda
