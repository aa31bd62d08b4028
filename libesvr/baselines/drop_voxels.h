#pragma once
/// Lossy compression of VDB files by dropping voxels near the background.

#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::baselines {

/// The change of a voxel's value if it is dropped: |value - background|, or, in a level set, the
/// distance from the band's edge, |background| - |value|.
class Deviation {
 public:
  explicit Deviation(const GridDescriptor& descriptor)
      : background_(float(descriptor.background)),
        levelSet_(descriptor.gridClass == GridClass::kLevelSet) {}
  [[nodiscard]] float operator()(float value) const;

 private:
  float background_;
  bool levelSet_;
};

/// The distinct deviations of the active voxels, increasing. Other thresholds have the same effect.
[[nodiscard]] std::vector<float> thresholds(const VolumeGrid& grid);

/// Drops the active voxels that deviate by `threshold` or less: they become inactive and hold the
/// background (in a level set, with their sign). Bricks without an active voxel are removed.
[[nodiscard]] VolumeGrid withoutVoxels(const VolumeGrid& grid, double threshold);

}  // namespace esvr::baselines
