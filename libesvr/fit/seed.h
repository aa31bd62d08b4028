#pragma once
/// New primitives where the error is.

#include <vector>

#include "fit/draw_voxels.h"
#include "fit/primitive.h"

namespace esvr {

struct SeedOptions {
  DrawOptions draw;
  int window = 2;             ///< half width of the neighbourhood that shapes a seed, voxels
  double unitVariance = 0.5;  ///< of the kernel (kernelVariance)
  double intensity = 1.0;     ///< of the residual at the seed
};

/// Voxels drawn by drawVoxels, each made an ellipsoid with the place, spread and height of the
/// residual of one sign around it.
[[nodiscard]] std::vector<Primitive> seedsFromResidual(const ResidualField& residual,
                                                       const SeedOptions& options);

/// Variance along an axis of phi taken as a density over the unit frame.
[[nodiscard]] double kernelVariance(const KernelConstants<double>& kernel);

}  // namespace esvr
