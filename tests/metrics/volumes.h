#pragma once
/// Small volumes for the tests of metrics.

#include <cstdint>
#include <functional>
#include <vector>

#include "esvr/metrics.h"
#include "esvr/volume.h"

namespace esvr::test {

/// A uniform number in [0, 1) that depends on its arguments only.
double hashUnit(std::uint64_t seed, std::uint64_t index);

struct Voxel {
  Coord at;
  float value = 0.0f;
};

/// A volume of single active voxels.
SparseVolume volumeOf(const std::vector<Voxel>& voxels, float background = 0.0f);

/// A volume that holds value(voxel) at every voxel of a box, all active.
SparseVolume volumeOf(const Box& box, const std::function<float(Coord)>& value,
                      float background = 0.0f);

struct RandomVolumeOptions {
  std::uint64_t seed = 0;
  int brickRange = 2;        ///< brick positions from -brickRange to brickRange - 1
  double brickShare = 0.1;   ///< share of the positions that have a brick
  double activeShare = 0.5;  ///< share of active voxels; others hold the background or a value
  float background = 0.0f;
};
SparseVolume randomVolume(const RandomVolumeOptions& options);

/// The same voxels at another position. \param by  displacement, multiples of 8
SparseVolume movedBy(SparseVolume volume, Coord by);

// ---- The metrics by their definitions, as plain float64 loops, which share no code with the bricks of the library

/// Computes all metrics. `everywhere` must contain all active voxels of both volumes.
VolumeMetrics denseMetrics(const SparseVolume& reference, const SparseVolume& candidate,
                           const Box& box, const Box& everywhere, double peak);

double denseSsim(const SparseVolume& reference, const SparseVolume& candidate, const Box& box,
                 double peak);

}  // namespace esvr::test
