#pragma once
/// Lossy by leaving out: the voxels that matter least become background.

#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::baselines {

/// How far a voxel is from what it would become: |value - background|; in a level set the distance
/// from the band's edge, |background| - |value|.
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

/// Distinct deviations of the active voxels, increasing: the thresholds that make a difference.
[[nodiscard]] std::vector<float> thresholds(const VolumeGrid& grid);

/// The grid without the active voxels that deviate by `threshold` or less: they are inactive and
/// hold the background (in a level set, with their sign). Bricks without an active voxel are gone.
[[nodiscard]] VolumeGrid withoutVoxels(const VolumeGrid& grid, double threshold);

}  // namespace esvr::baselines
