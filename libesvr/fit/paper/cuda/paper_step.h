#pragma once
/// A step of the paper's method, one thread an ellipsoid and so one writer.

#include <cuda_runtime_api.h>

#include "fit/cuda/moment_sums.h"
#include "fit/paper/paper_math.h"

namespace esvr::cuda {

/// Ellipsoids in the paper's form and in those that passes and lists take. Pointers are to device
/// memory, borrowed.
struct PaperEllipsoids {
  std::uint32_t count;
  paper::KernelKind kind;
  Kernel kernel;                      ///< of the scene
  KernelConstants<double> constants;  ///< likewise
  paper::PaperEllipsoid* ellipsoids;
  paper::PaperState* states;
  Ellipsoid* units;
  PairForm* forms;
  KernelConstants<float>* kernels;  ///< an ellipsoid's, where k is learned; else null
  double* radii;                    ///< of the supports, likewise
  int* diverged;                    ///< set to 1 where an ellipsoid is not finite
};

/// Writes units, forms, kernels and radii.
void launchPaperForms(const PaperEllipsoids& ellipsoids, cudaStream_t stream);

/// Takes the step; wants launchMomentSums before.
void launchPaperStep(const PaperEllipsoids& ellipsoids, const MomentSums& sums,
                     const paper::PaperStep& step, cudaStream_t stream);

/// Writes the gradients by the paper's parameters; wants launchMomentSums before.
void launchPaperGradients(const PaperEllipsoids& ellipsoids, const MomentSums& sums,
                          paper::PaperVector* out, cudaStream_t stream);

}  // namespace esvr::cuda
