#pragma once
/// Growth and relocation on the device: finds the ellipsoids whose removal adds the smallest error,
/// draws voxels of large error, and makes new ellipsoids there. All pointers in arguments are to
/// device memory that the caller owns.

#include <cuda_runtime_api.h>

#include "core/cuda/device_buffer.h"
#include "esvr/volume.h"
#include "fit/adam.h"
#include "fit/cuda/lists.h"
#include "fit/cuda/step.h"
#include "fit/seed.h"

namespace esvr::cuda {

/// Ranks ellipsoids by the error that their removal adds.
class EllipsoidRanking {
 public:
  explicit EllipsoidRanking(cudaStream_t stream);

  struct Chosen {
    const std::uint32_t* places;  ///< in device memory; the least useful ellipsoid first
    std::size_t count;
  };
  /// The `count` ellipsoids whose removal adds the smallest error. Only ellipsoids that have
  /// taken graceSteps steps are chosen, so the result may be shorter.
  [[nodiscard]] Chosen leastUseful(const StepArguments& fit, std::size_t count, int graceSteps);

 private:
  cudaStream_t stream_;
  GrowingBuffer<float> keys_, sortedKeys_;
  GrowingBuffer<std::uint32_t> places_, sortedPlaces_, settled_;
  GrowingBuffer<char> temporary_;
};

struct SamplingArguments;

struct DeviceSampling {
  const Coord* voxels = nullptr;  ///< distinct voxels, in device memory
  std::uint32_t count = 0;
  double share = 0.0;  ///< energy for each draw
};

/// Samples voxels in proportion to their squared residual, as sampleVoxels() does on the CPU
/// (fit/cpu/residual.h).
class VoxelSampling {
 public:
  explicit VoxelSampling(cudaStream_t stream);

  /// \param residual  kBrickVoxels values for each brick; at least options.targetBricks bricks
  /// \param loss      sum of r^2 over all bricks; must be finite
  /// \param bricks    coordinates of the bricks
  /// \return no voxels if seeds cannot reduce any residual
  [[nodiscard]] DeviceSampling draw(const float* residual, double loss, const Coord* bricks,
                                    const SamplingOptions& options);

 private:
  [[nodiscard]] std::uint64_t sumEnergies(const SamplingArguments& arguments);
  [[nodiscard]] std::uint32_t keepEachOnce(std::uint32_t count);

  cudaStream_t stream_;
  GrowingBuffer<std::uint64_t> energy_, sums_;
  GrowingBuffer<Coord> drawn_, voxels_;
  GrowingBuffer<std::uint32_t> count_;
  GrowingBuffer<char> temporary_;
};

struct SeedArguments {
  const Coord* voxels;  ///< sampled voxels
  std::uint32_t count;
  BrickTableView bricks;
  const float* residual;      ///< kBrickVoxels values for each brick
  int window;                 ///< half width of the window that shapes a seed, voxels
  double unitVariance;        ///< variance of the kernel
  double intensity;           ///< intensity of a seed, relative to the residual
  double share;               ///< energy for each draw
  const std::uint32_t* into;  ///< places of the seeds; null: firstPlace and those after it
  std::uint32_t firstPlace;
  Ellipsoid* ellipsoids;
  AdamState* states;
};

/// Makes new ellipsoids at sampled voxels.
void launchPlaceSeeds(const SeedArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
