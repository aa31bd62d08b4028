#pragma once
/// Chooses the threshold that tells active voxels from the rest.

#include <span>

#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"
#include "field/voxel_rule.h"

namespace esvr::format {

struct ThresholdChoice {
  float threshold = 0.0f;
  double iou = 0.0;  ///< intersection over union of active voxels, source and result
};

/// The best overlap that costs no squared error worth telling (0.004 dB), to 1/128 of the
/// threshold: one evaluation of the field and a histogram. Where several thresholds do as well, one
/// amid them, so that rounding on another machine changes nothing. \param bricks  where the field
/// will be evaluated: increasing index corners
/// \param rule  its threshold takes no part
[[nodiscard]] ThresholdChoice chooseThreshold(const SparseVolume& source, const Field& field,
                                              const VoxelRule& rule, std::span<const Coord> bricks);

}  // namespace esvr::format
