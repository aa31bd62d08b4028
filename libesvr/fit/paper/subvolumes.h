#pragma once
/// The subvolumes of the paper's method, which are cubes.

#include <memory>
#include <vector>

#include "fit/target.h"

namespace esvr::paper {

/// The volume that is divided: whole bricks around the target's box and bricks.
struct Space {
  Box bricks;
  [[nodiscard]] int longestAxis() const;   ///< voxels
  [[nodiscard]] int shortestAxis() const;  ///< voxels
  [[nodiscard]] Box voxels() const;
};
[[nodiscard]] Space spaceOf(const FitTarget& target);

/// The side of the subvolumes, which is a multiple of 8 voxels.
/// \param asked  wanted side in voxels; 0: half the longest axis, or the shortest axis if that is
///               less (paper, appendix 'Subvolume configuration')
[[nodiscard]] int subvolumeSide(const Space& space, int asked);

/// A subvolume: its part of the target, whose `within` is the box of the subvolume.
struct Subvolume {
  FitTarget target;
  std::vector<BrickMask> active;
};

/// Divides a target into subvolumes in the order of their coordinates, including those without
/// target bricks. They are allocated one by one, because each target points to its masks.
[[nodiscard]] std::vector<std::unique_ptr<Subvolume>> cutSubvolumes(const FitTarget& target,
                                                                    const Space& space, int side);

}  // namespace esvr::paper
