#pragma once
/// Chooses the levels of a grid whose blocks have thresholds of their own (esvr/block_levels.h).

#include <optional>

#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"
#include "field/voxel_rule.h"
#include "format/active_threshold.h"
#include "format/level_section.h"

namespace esvr::format {

/// What levels are chosen for.
struct LevelTask {
  const SparseVolume& source;
  const Field& field;
  VoxelRule rule;               ///< rule of the voxels; its threshold is not used
  const ThresholdPlace& place;  ///< its box is the active box of the source
  float base;                   ///< threshold of level 0, above 0
  double error;                 ///< error of the sum at active voxels (root mean square), above 0
};

/// The levels that take the fewest bits among those found whose overlap with the source suffices
/// (MaskOverlap, esvr/simplified_mask.h). A voxel in the wrong state costs the more, the more it
/// adds to the squared error. The result is the same for any number of threads.
/// \return nothing if no levels suffice
[[nodiscard]] std::optional<Levels> chooseLevels(const LevelTask& task);

}  // namespace esvr::format
