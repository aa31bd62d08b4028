#pragma once
/// A level set: signed distances in a narrow band around a closed surface.

#include <optional>

#include "esvr/sparse_volume.h"
#include "generators/sample_options.h"
#include "generators/voxelise.h"

namespace esvr::samples {

inline constexpr double kBandVoxels = 3.0;  ///< half width of the narrow band, OpenVDB's default

/// A ring and two balls that intersect it, about `resolution` voxels wide. Values are distances
/// times the voxel size, negative inside. Voxels within the band are active; others hold plus or
/// minus the background.
class LevelSetShape {
 public:
  LevelSetShape(int resolution, double voxelSize)
      : resolution_(resolution), voxelSize_(voxelSize) {}

  /// The signed distance in voxels. It is exact except deep inside, where parts overlap; there it
  /// is a lower bound of the depth.
  [[nodiscard]] double distance(Vec3 p) const;
  [[nodiscard]] std::optional<LevelSetShape> within(const Ball& ball) const;
  [[nodiscard]] Sample at(Vec3 p) const;

 private:
  int resolution_;
  double voxelSize_;
};

/// The background is the band's half width.
[[nodiscard]] SparseVolume makeLevelSet(const SampleOptions& options, double voxelSize);

}  // namespace esvr::samples
