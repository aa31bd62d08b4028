#pragma once
/// Starts the evaluation of bricks.

#include <cuda_runtime_api.h>

#include <cstdint>

#include "esvr/coord.h"
#include "esvr/kernel.h"
#include "field/line_form.h"

namespace esvr::cuda {

/// What the kernel reads and writes. Pointers are to device memory, borrowed.
struct EvaluateArguments {
  const LineForm* forms;          ///< an ellipsoid's, center relative to its chunk's origin
  const std::uint32_t* chunkOf;   ///< an ellipsoid's
  const Coord* origins;           ///< of the chunks
  KernelConstants<float> kernel;  ///< of all ellipsoids, where ownKernels is null
  const KernelConstants<float>* ownKernels;  ///< an ellipsoid's

  std::uint32_t bricks;
  const Coord* corners;             ///< of the bricks
  const std::uint32_t* brickBegin;  ///< bricks + 1: range of a brick's pairs
  std::uint32_t firstPair;          ///< number of the pair that `ellipsoid` begins with
  const std::uint32_t* ellipsoid;   ///< of the pairs

  float background;
  float* values;  ///< out: kBrickVoxels a brick
};

/// Returns before the values are there. \param stream  of the current device
void launchEvaluate(const EvaluateArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
