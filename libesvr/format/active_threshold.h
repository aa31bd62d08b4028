#pragma once
/// Chooses the threshold of a grid whose voxels are active by value.

#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"
#include "field/voxel_rule.h"

namespace esvr::format {

struct ThresholdChoice {
  float threshold = 0.0f;
  double iou = 0.0;      ///< intersection over union of the active voxels of source and result
  double squares = 0.0;  ///< squared error of the place's voxels if all of them are active
};

/// Where voxels may become active.
struct ThresholdPlace {
  std::vector<Coord> bricks;  ///< index corners, increasing, of the bricks that a reader evaluates
  Box box;                    ///< voxels outside it are inactive
};

/// Chooses the threshold with the best overlap of the active voxels among those that add no more
/// than 0.004 dB to the error. It is precise to 1/128 of its value. The search takes one evaluation
/// of the field and a histogram. If several thresholds are as good, a middle one is taken, so that
/// rounding on another machine changes no voxel.
/// \param rule  rule of the voxels; its threshold is ignored
[[nodiscard]] ThresholdChoice chooseThreshold(const SparseVolume& source, const Field& field,
                                              const VoxelRule& rule, const ThresholdPlace& place);

}  // namespace esvr::format
