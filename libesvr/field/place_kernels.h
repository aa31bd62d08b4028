#pragma once
/// The inner loop over one ellipsoid and places between the voxels of a brick. It is compiled with the
/// loops of brick_kernels.h. Its table is a separate one, so that a program that evaluates no places
/// does not contain the loop.

#include <vector>

#include "field/brick_kernels.h"

namespace esvr {

/// Places in a brick, relative to its first voxel. The arrays are 64-byte aligned.
struct PlaceBlock {
  static constexpr int kMultiple = 16;  ///< `count` is a multiple of it, which fills all registers

  const float *x, *y, *z;
  int count;
};

/// Adds intensity * phi to the sum of each place.
/// \param corner  first voxel of the brick, in the frame of f.center
using AddPlaces = void (*)(const LineForm& f, const float corner[3],
                           const KernelConstants<float>& k, const PlaceBlock& places, float* sum);

/// The loops for all instruction sets that this processor has, in the order of runnableKernels().
[[nodiscard]] std::vector<AddPlaces> runnablePlaceKernels();

/// The loop for the best instruction set of this processor.
[[nodiscard]] AddPlaces placeKernel();

}  // namespace esvr
