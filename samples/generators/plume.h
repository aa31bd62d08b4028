#pragma once
/// A noisy smoke plume.

#include <cstdint>
#include <optional>

#include "esvr/sparse_volume.h"
#include "generators/sample_options.h"
#include "generators/voxelise.h"

namespace esvr::samples {

/// Smoke that rises along y, widens and dissolves; it is `resolution` voxels high. The noise has
/// features down to a few voxels, so a finer plume has more detail. From frame to frame the eddies
/// rise, and change their shape, because the warp that forms them rises more slowly.
class PlumeShape {
 public:
  PlumeShape(std::uint64_t seed, int resolution, int frame = 0);

  [[nodiscard]] std::optional<PlumeShape> within(const Ball& ball) const;
  [[nodiscard]] Sample at(Vec3 voxel) const;

 private:
  // points p have a height of 0 to 1 along y; the axis is near x = z = 0
  [[nodiscard]] Vec3 place(Vec3 voxel) const;
  [[nodiscard]] double envelopeRadius(double y) const;
  [[nodiscard]] double distanceToAxis(Vec3 p) const;
  [[nodiscard]] Vec3 warped(Vec3 p) const;
  /// The place that noise has at p after all frames so far. \param rise  heights that it rises in a
  /// frame
  [[nodiscard]] Vec3 before(Vec3 p, double rise) const;
  [[nodiscard]] double densityAt(Vec3 p) const;

  std::uint64_t seed_;
  int resolution_, octaves_, frame_;
};

[[nodiscard]] SparseVolume makePlume(const SampleOptions& options);

}  // namespace esvr::samples
