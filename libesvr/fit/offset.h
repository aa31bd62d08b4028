#pragma once
/// The positions at which the iterations of a fit compare the sum with the target: the centers of
/// the voxels, all moved by the same offset. The code is compiled for host and device.

#include <array>
#include <cmath>
#include <cstdint>

#include "esvr/kernel.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// A displacement in voxels along each axis, at most kMaxOffset in magnitude.
using Offset = std::array<double, 3>;
inline constexpr Offset kAtVoxels{};
inline constexpr double kMaxOffset = 0.5;

/// The center of an ellipsoid, as seen from voxels that are moved by an offset.
[[nodiscard]] ESVR_HD inline std::array<double, 3> movedBack(const std::array<double, 3>& center,
                                                             const Offset& offset) {
  return {center[0] - offset[0], center[1] - offset[1], center[2] - offset[2]};
}

/// The offset of an iteration. Offsets form the additive recurrence of the root g of g^4 = g + 1.
/// This sequence covers a cube evenly after any number of iterations.
/// \param voxelShare  share of the iterations that compare at the voxels themselves, which are
///                    spread evenly over the run
[[nodiscard]] inline Offset offsetOf(std::uint64_t iteration, double voxelShare) {
  const double n = double(iteration) + 1.0;
  if (std::floor(voxelShare * n) > std::floor(voxelShare * double(iteration))) return kAtVoxels;
  constexpr double kG = 1.2207440846057596;
  const auto place = [&](double step) { return n * step - std::floor(n * step) - kMaxOffset; };
  return {place(1.0 / kG), place(1.0 / (kG * kG)), place(1.0 / (kG * kG * kG))};
}

/// Interpolation along an axis at p + offset, for the voxels p = 0 to 7 of a brick. It reads the
/// voxels p + first and p + first + 1, some of which are in the next brick at `side`.
struct OffsetAxis {
  int first;     ///< -1 or 0
  int side;      ///< -1 or 1
  float weight;  ///< weight of the second voxel
};
[[nodiscard]] ESVR_HD inline OffsetAxis offsetAxis(double offset) {
  const int first = offset < 0.0 ? -1 : 0;
  return {first, first < 0 ? -1 : 1, float(offset - first)};
}

[[nodiscard]] ESVR_HD inline std::array<OffsetAxis, 3> offsetAxes(const Offset& offset) {
  return {offsetAxis(offset[0]), offsetAxis(offset[1]), offsetAxis(offset[2])};
}

/// A voxel that an interpolation reads, along an axis.
struct OffsetPlace {
  bool next;    ///< whether it lies in the next brick
  int local;    ///< place within its brick
  int nearest;  ///< nearest place within the brick itself
};
/// \param n  number of the voxel, from 0 for `first` to 8
[[nodiscard]] ESVR_HD inline OffsetPlace offsetPlace(const OffsetAxis& axis, int n) {
  const int p = axis.first + n, last = kBrickSide - 1;
  const int nearest = p < 0 ? 0 : (p > last ? last : p);
  return {p != nearest, p & last, nearest};
}

/// The bricks that an interpolation reads are numbered 4 x + 2 y + z, where x, y and z are 0 for
/// the brick itself and 1 for the next one along the axis.
inline constexpr int kInterpolatedBricks = 8;
/// \return brick `n` of those that an interpolation in `brick` reads
[[nodiscard]] ESVR_HD inline Coord interpolatedBrick(Coord brick, const OffsetAxis* axes, int n) {
  return {brick.x + (n >> 2) * axes[0].side, brick.y + (n >> 1 & 1) * axes[1].side,
          brick.z + (n & 1) * axes[2].side};
}

}  // namespace esvr
