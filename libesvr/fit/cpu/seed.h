#pragma once
/// New ellipsoids where the error is.

#include <vector>

#include "fit/cpu/sample_voxels.h"
#include "fit/ellipsoid.h"

namespace esvr {

struct SeedOptions {
  SamplingOptions draw;
  int window = 2;             ///< half width of the neighbourhood that shapes a seed, voxels
  double unitVariance = 0.5;  ///< of the kernel (kernelVariance)
  double intensity = 1.0;     ///< of the residual at the seed
};

/// Voxels drawn by sampleVoxels, each made an ellipsoid with the place, spread and height of the
/// residual of one sign around it.
[[nodiscard]] std::vector<Ellipsoid> seedsFromResidual(const ResidualField& residual,
                                                       const SeedOptions& options);

/// Variance along an axis of phi taken as a density over the unit frame.
[[nodiscard]] double kernelVariance(const KernelConstants<double>& kernel);

}  // namespace esvr
