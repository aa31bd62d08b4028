#pragma once
/// Estimates how a volume has moved from one frame of a sequence to the next.

#include <array>
#include <cstddef>
#include <vector>

#include "core/brick_index.h"
#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"

namespace esvr::convert {

/// A displacement in voxels, or a place in index coordinates.
using Vector3 = std::array<double, 3>;

/// A displacement for each brick of a volume, which is interpolated between the middles of bricks.
class MotionField {
 public:
  /// \param bricks  coordinates of the bricks, in bricks from the origin of the index space
  MotionField(std::vector<Coord> bricks, std::vector<Vector3> motions);

  [[nodiscard]] Vector3 at(const Vector3& place) const;

 private:
  BrickIndex index_;
  std::vector<Vector3> motions_;
};

/// Estimates the motion with which `before` becomes most like `now`: the method of Lucas and Kanade
/// (1981) in windows of 3^3 bricks, from coarse to fine. Motions of up to about 16 voxels are found.
[[nodiscard]] MotionField estimateMotion(const SparseVolume& before, const SparseVolume& now);

/// The field with every center moved.
[[nodiscard]] Field moved(Field field, const MotionField& motion);

}  // namespace esvr::convert
