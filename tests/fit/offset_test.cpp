// Plan: the offsets of iterations lie within half a voxel, cover the cube evenly, and leave out the
// wanted share of the iterations. The interpolation of a brick agrees with a float64 interpolation
// of a function of the voxels for offsets in every direction, and fills missing bricks as asked.

#include "fit/offset.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "../field/random_field.h"
#include "esvr/sparse_volume.h"
#include "fit/cpu/interpolated_brick.h"
#include "interpolate.h"

namespace esvr {
namespace {

TEST(Offset, CoversTheCubeEvenly) {
  constexpr int kCount = 4096, kOctants = 8;
  std::array<int, kOctants> counts{};
  for (int n = 0; n < kCount; ++n) {
    const Offset offset = offsetOf(std::uint64_t(n), 0.0);
    int octant = 0;
    for (const double v : offset) {
      EXPECT_LE(std::abs(v), kMaxOffset);
      octant = 2 * octant + (v < 0.0 ? 1 : 0);
    }
    ++counts[std::size_t(octant)];
  }
  for (const int count : counts) EXPECT_NEAR(count, kCount / kOctants, 0.05 * kCount / kOctants);
}

TEST(Offset, LeavesTheWantedShareAtTheVoxels) {
  for (const double share : {0.0, 0.125, 0.25, 0.6, 1.0}) {
    int atVoxels = 0;
    for (int n = 0; n < 1000; ++n)
      atVoxels += offsetOf(std::uint64_t(n), share) == kAtVoxels ? 1 : 0;
    EXPECT_NEAR(atVoxels, 1000 * share, 1.0) << share;
  }
}

/// A brick and all bricks around it, with random values.
class Neighbourhood {
 public:
  Neighbourhood() {
    test::Random random(3);
    for (auto& brick : bricks_)
      for (float& v : brick) v = float(random(-1.0, 1.0));
  }

  /// The value of a voxel, counted from the lowest one of the brick in the middle.
  [[nodiscard]] double at(Coord v) const {
    return double(brick(brickOf(v))[std::size_t(voxelOffset(v - brickOf(v) * kBrickSide))]);
  }

  /// \param hasBrick  whether there is a brick at the place, from -1 to 1 along each axis
  template <class HasBrick>
  [[nodiscard]] std::vector<float> interpolated(const Offset& offset, Missing missing,
                                                const HasBrick& hasBrick) const {
    const auto axes = offsetAxes(offset);
    InterpolatedBricks around{};
    for (int n = 0; n < kInterpolatedBricks; ++n) {
      const Coord place = interpolatedBrick({0, 0, 0}, axes.data(), n);
      if (hasBrick(place)) around[std::size_t(n)] = brick(place).data();
    }
    std::vector<float> out(kBrickVoxels);
    interpolateBrick(around, offset, missing, out);
    return out;
  }

 private:
  static int voxelOffset(Coord v) { return (v.x * kBrickSide + v.y) * kBrickSide + v.z; }
  [[nodiscard]] const std::array<float, kBrickVoxels>& brick(Coord place) const {
    return bricks_[std::size_t((place.x + 1) * 9 + (place.y + 1) * 3 + place.z + 1)];
  }

  std::array<std::array<float, kBrickVoxels>, 27> bricks_;
};

constexpr Offset kOffsets[] = {{0.3, 0.2, 0.4},   {-0.3, 0.2, 0.4},   {0.3, -0.2, 0.4},
                               {0.3, 0.2, -0.4},  {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5},
                               {-0.1, 0.0, 0.25}, {0.0, 0.0, 0.0}};
// Three interpolations in float32 of values up to 1, each with two roundings.
constexpr double kRounding = 6 * 0x1p-23;

TEST(InterpolatedBrick, AgreesWithFloat64) {
  const Neighbourhood around;
  for (const Offset& offset : kOffsets) {
    const auto found = around.interpolated(offset, Missing::kZero, [](Coord) { return true; });
    for (int v = 0; v < kBrickVoxels; ++v)
      ASSERT_NEAR(double(found[std::size_t(v)]),
                  test::interpolate(offset, voxelLocal(v), [&](Coord c) { return around.at(c); }),
                  kRounding)
          << offset[0] << ' ' << offset[1] << ' ' << offset[2] << ", voxel " << v;
  }
}

TEST(InterpolatedBrick, TakesZeroOrTheNearestVoxelForAMissingBrick) {
  const Neighbourhood around;
  const auto isMiddle = [](Coord place) { return place == Coord{0, 0, 0}; };
  const auto clamped = [](std::int32_t p) { return std::clamp(p, 0, kBrickSide - 1); };
  for (const Offset& offset : kOffsets) {
    const auto zero = around.interpolated(offset, Missing::kZero, isMiddle);
    const auto nearest = around.interpolated(offset, Missing::kNearest, isMiddle);
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = voxelLocal(v);
      const auto orZero = [&](Coord c) { return isMiddle(brickOf(c)) ? around.at(c) : 0.0; };
      const auto orNearest = [&](Coord c) {
        return around.at({clamped(c.x), clamped(c.y), clamped(c.z)});
      };
      ASSERT_NEAR(double(zero[std::size_t(v)]), test::interpolate(offset, at, orZero), kRounding);
      ASSERT_NEAR(double(nearest[std::size_t(v)]), test::interpolate(offset, at, orNearest),
                  kRounding);
    }
  }
}

}  // namespace
}  // namespace esvr
