#pragma once
/// The cubes that the paper's method visits one after the other.

#include <memory>
#include <vector>

#include "fit/target.h"

namespace esvr::paper {

/// The volume that is cut: its own box and the target's bricks, whole bricks of them.
struct Space {
  Box bricks;
  [[nodiscard]] int longestAxis() const;   ///< voxels
  [[nodiscard]] int shortestAxis() const;  ///< voxels
  [[nodiscard]] Box voxels() const;
};
[[nodiscard]] Space spaceOf(const FitTarget& target);

/// Half the longest axis, or the shortest where that is less, in whole bricks (paper, appendix
/// 'Subvolume configuration').
/// \param asked  voxels; 0: as said
[[nodiscard]] int subvolumeSide(const Space& space, int asked);

/// One of them: its bricks of the target, and a box beyond which nothing counts.
struct Subvolume {
  FitTarget target;
  std::vector<BrickMask> active;
};

/// In the order of their coordinates, those without target bricks too. Each on its own place in
/// memory: targets point to their masks.
[[nodiscard]] std::vector<std::unique_ptr<Subvolume>> cutSubvolumes(const FitTarget& target,
                                                                    const Space& space, int side);

}  // namespace esvr::paper
