#pragma once
/// What a fit on the CPU does with the residuals of a pass: it measures errors, draws voxels of
/// large error, and makes new ellipsoids there.

#include <span>
#include <vector>

#include "core/brick_index.h"
#include "esvr/volume.h"
#include "fit/optimiser.h"
#include "fit/seed.h"

namespace esvr {

/// The residuals r = V - target in the bricks of a pass; they are zero elsewhere.
struct ResidualField {
  const BrickIndex& index;
  std::span<const float> values;  ///< kBrickVoxels values for each brick

  [[nodiscard]] std::span<const float> brick(std::size_t b) const {
    return values.subspan(b * kBrickVoxels, kBrickVoxels);
  }
  [[nodiscard]] float at(Coord voxel) const {
    const auto b = index.find(brickOf(voxel));
    return b == BrickIndex::kNone ? 0.0f : values[b * kBrickVoxels + voxelOffset(localOf(voxel))];
  }
};

/// \param residual  residuals whose first bricks are the target's
[[nodiscard]] FitErrors errorsOf(const FitTarget& target, const ResidualField& residual);

struct SampledVoxels {
  std::vector<Coord> voxels;  ///< distinct voxels
  double share = 0.0;         ///< energy for each draw
};

/// Systematic sampling in the order of the bricks: the total energy is divided into `count` equal
/// shares, and one voxel is drawn from each. A voxel that covers several shares is drawn once. The
/// result is empty if seeds cannot reduce any residual.
[[nodiscard]] SampledVoxels sampleVoxels(const ResidualField& residual,
                                         const SamplingOptions& options);

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
