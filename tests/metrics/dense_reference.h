#pragma once
/// The metrics by their definitions, as plain float64 loops over every voxel of a box. They share
/// no code with the library's bricks.

#include "esvr/metrics.h"

namespace esvr::test {

/// Computes all metrics. `everywhere` must contain all active voxels of both volumes.
VolumeMetrics denseMetrics(const SparseVolume& reference, const SparseVolume& candidate,
                           const Box& box, const Box& everywhere, double peak);

double denseSsim(const SparseVolume& reference, const SparseVolume& candidate, const Box& box,
                 double peak);

}  // namespace esvr::test
