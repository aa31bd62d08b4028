#pragma once
/// The motions of the ellipsoids that were coded before, by place.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>

#include "core/brick_hash.h"
#include "esvr/coord.h"

namespace esvr::codec {

/// Motions or places along the three axes, in the units of the caller.
using Vector64 = std::array<std::int64_t, 3>;

/// What the motions around a place sum up to. Only integers are used, so that the order of the
/// ellipsoids does not matter.
struct MotionSum {
  std::int64_t count = 0;
  Vector64 now{}, before{};  ///< motions to this frame, and to the frame before it
  std::int64_t error = 0;    ///< magnitudes of the errors of predictions

  void add(const MotionSum& other) {
    count += other.count, error += other.error;
    for (std::size_t a = 0; a < 3; ++a) now[a] += other.now[a], before[a] += other.before[a];
  }
};

/// Sums motions in cubes.
class MotionMap {
 public:
  /// Chooses the smallest cubes that hold kEllipsoidsPerCube of these places on average.
  explicit MotionMap(std::span<const Vector64> places);

  void add(const Vector64& place, const MotionSum& motion) { cubes_[cubeOf(place)].add(motion); }

  /// The sum over the cube of a place and the cubes around it.
  [[nodiscard]] MotionSum around(const Vector64& place) const;

 private:
  struct Hash {
    std::size_t operator()(Coord c) const { return std::size_t(hashOf(c)); }
  };

  [[nodiscard]] Coord cubeOf(const Vector64& place) const;

  int sideLog2_ = 0;
  std::unordered_map<Coord, MotionSum, Hash> cubes_;
};

}  // namespace esvr::codec
