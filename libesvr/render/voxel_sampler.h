#pragma once
/// Trilinear interpolation in a sparse volume.

#include <array>
#include <cmath>
#include <vector>

#include "core/brick_index.h"
#include "esvr/camera.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// The eight voxels around a place: the one at or below it, and the way to the next one.
struct Cell {
  Coord voxel;
  std::array<float, 3> fraction;
};

[[nodiscard]] inline Cell cellOf(const Vec3& place) {
  const double x = std::floor(place[0]), y = std::floor(place[1]), z = std::floor(place[2]);
  return {{std::int32_t(x), std::int32_t(y), std::int32_t(z)},
          {float(place[0] - x), float(place[1] - y), float(place[2] - z)}};
}

/// Coordinates are relative to the volume's origin. Keeps a reference to the volume.
class VoxelSampler {
 public:
  /// Positions of a brick and of its neighbours above along x (4), y (2) and z (1); kNone where
  /// there is none.
  using Corners = std::array<std::uint32_t, 8>;

  explicit VoxelSampler(const SparseVolume& volume);

  /// The bricks for the cells of a brick; null where all of those are background.
  [[nodiscard]] const Corners* find(Coord brick) const {
    const std::uint32_t at = index_.find(brick);
    return at == BrickIndex::kNone ? nullptr : &corners_[at];
  }
  /// Exactly the background where all eight voxels are.
  [[nodiscard]] float interpolate(const Corners& corners, const Cell& cell) const;

  /// Outside of this box are no cells but those of the background.
  [[nodiscard]] const Vec3& low() const { return low_; }
  [[nodiscard]] const Vec3& high() const { return high_; }

 private:
  [[nodiscard]] float value(const Corners& corners, Coord local) const;

  const SparseVolume& volume_;
  BrickIndex index_;
  std::vector<Corners> corners_;
  Vec3 low_, high_;
};

}  // namespace esvr
