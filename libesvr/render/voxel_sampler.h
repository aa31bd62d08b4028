#pragma once
/// Trilinear interpolation in a sparse volume.

#include <array>
#include <cmath>
#include <vector>

#include "core/brick_index.h"
#include "core/cell_corner.h"
#include "esvr/camera.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// The eight voxels around a place, given by the lowest of them and the position of the place
/// between it and the next voxels, from 0 to 1 along each axis.
struct Cell {
  Coord voxel;
  std::array<float, 3> fraction;
};

[[nodiscard]] inline Cell cellOf(const Vec3& place) {
  const double x = std::floor(place[0]), y = std::floor(place[1]), z = std::floor(place[2]);
  return {{std::int32_t(x), std::int32_t(y), std::int32_t(z)},
          {float(place[0] - x), float(place[1] - y), float(place[2] - z)}};
}

/// Interpolates in a volume, to which it keeps a reference. Coordinates are relative to the
/// volume's origin.
class VoxelSampler {
 public:
  /// The numbers of a brick and of its seven upper neighbours, by the number of the corner. kNone:
  /// no such brick.
  using Corners = std::array<std::uint32_t, kCellCorners>;

  explicit VoxelSampler(const SparseVolume& volume);

  /// The bricks that the cells of a brick read; null if all these voxels are the background.
  [[nodiscard]] const Corners* find(Coord brick) const {
    const std::uint32_t at = index_.find(brick);
    return at == BrickIndex::kNone ? nullptr : &corners_[at];
  }
  /// The result is exactly the background if all eight voxels are.
  [[nodiscard]] float interpolate(const Corners& corners, const Cell& cell) const;

  /// All cells outside this box have the background at their corners.
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
