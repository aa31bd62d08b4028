#pragma once
/// The metrics by their definitions: plain loops over every voxel of a box, float64. Slow, and
/// independent of the library's bricks, trees and shortcuts.

#include "esvr/metrics.h"

namespace esvr::test {

/// `everywhere` must hold all active voxels of both volumes.
VolumeMetrics denseMetrics(const SparseVolume& reference, const SparseVolume& candidate,
                           const Box& box, const Box& everywhere, double peak);

double denseSsim(const SparseVolume& reference, const SparseVolume& candidate, const Box& box,
                 double peak);

}  // namespace esvr::test
