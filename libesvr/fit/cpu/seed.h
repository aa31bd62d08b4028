#pragma once
/// Makes seeds, which are new ellipsoids at voxels of large error.

#include <vector>

#include "fit/cpu/sample_voxels.h"
#include "fit/ellipsoid.h"

namespace esvr {

struct SeedOptions {
  SamplingOptions draw;
  int window = 2;             ///< half width of the window that shapes a seed, voxels
  double unitVariance = 0.5;  ///< KernelMoments::variance
  double intensity = 1.0;     ///< intensity of a seed, relative to the residual
};

/// Makes a seed at each voxel that sampleVoxels draws. Its position, shape and intensity follow
/// from the residual of one sign around the voxel.
[[nodiscard]] std::vector<Ellipsoid> seedsFromResidual(const ResidualField& residual,
                                                       const SeedOptions& options);

}  // namespace esvr
