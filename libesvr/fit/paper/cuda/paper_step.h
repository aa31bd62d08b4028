#pragma once
/// A step of the paper's method. One thread writes each ellipsoid.

#include <cuda_runtime_api.h>

#include "fit/cuda/moment_sums.h"
#include "fit/paper/paper_math.h"

namespace esvr::cuda {

/// Ellipsoids in the paper's parameters and in the forms that passes and lists use. All pointers
/// are to device memory that the caller owns.
struct PaperEllipsoids {
  std::uint32_t count;
  paper::KernelKind kind;
  Kernel kernel;                      ///< kernel of the scene
  KernelConstants<double> constants;  ///< constants of that kernel
  paper::PaperEllipsoid* ellipsoids;
  paper::PaperState* states;
  Ellipsoid* units;
  PairForm* forms;
  KernelConstants<float>* kernels;  ///< kernel of each ellipsoid if k is learned; else null
  double* radii;                    ///< radius of each support if k is learned; else null
  int* diverged;                    ///< is set to 1 if an ellipsoid is not finite
};

/// Writes units, forms, kernels and radii.
void launchPaperForms(const PaperEllipsoids& ellipsoids, cudaStream_t stream);

/// Takes the step. launchMomentSums must have been called before.
void launchPaperStep(const PaperEllipsoids& ellipsoids, const MomentSums& sums,
                     const paper::PaperStep& step, cudaStream_t stream);

/// Writes the gradients by the paper's parameters. launchMomentSums must have been called before.
void launchPaperGradients(const PaperEllipsoids& ellipsoids, const MomentSums& sums,
                          paper::PaperVector* out, cudaStream_t stream);

}  // namespace esvr::cuda
