#pragma once
/// Chooses the scene's kappa by short fits of a part of the volume.

#include <vector>

#include "esvr/fit.h"
#include "fit/recorder.h"

namespace esvr {

struct PilotResult {
  float kappa;
  std::vector<PilotPoint> points;  ///< in the order they were tried
};

/// Fits a stretch of neighbouring bricks, with as many primitives a voxel as the whole is to get,
/// at a few kappas: first coarse, then beside the best.
[[nodiscard]] PilotResult chooseKappa(const FitTarget& target, std::size_t count,
                                      const OptimiserOptions& options, const Tuning& tuning,
                                      const Recorder& recorder);

}  // namespace esvr
