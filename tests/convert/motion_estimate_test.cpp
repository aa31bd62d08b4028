// Plan: blobs that move by known displacements are found again, also between voxels, far from the
// origin and by more than a brick. Where there is nothing to see, nothing moves.

#include "convert/motion_estimate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../fit/volumes.h"

namespace esvr::convert {
namespace {

constexpr int kBricks = 6;
constexpr double kMiddle = kBricks * kBrickSide / 2;

/// A sum of three blobs of different widths around a place, relative to a corner.
SparseVolume blobsAt(Coord corner, const Vector3& place) {
  return test::volumeOf(corner, kBricks, 0.0f, [&](Coord v) {
    const auto blob = [&](double x, double y, double z, double width) {
      const double dx = v.x - corner.x - place[0] - x, dy = v.y - corner.y - place[1] - y,
                   dz = v.z - corner.z - place[2] - z;
      return std::exp(-(dx * dx + dy * dy + dz * dz) / (2.0 * width * width));
    };
    return float(blob(0, 0, 0, 4.0) + 0.7 * blob(6, -3, 1, 3.0) + 0.5 * blob(-4, 5, -6, 2.5));
  });
}

void expectFound(Coord corner, const Vector3& by, double tolerance) {
  const Vector3 from{kMiddle, kMiddle, kMiddle};
  const Vector3 to{from[0] + by[0], from[1] + by[1], from[2] + by[2]};
  const MotionField motion = estimateMotion(blobsAt(corner, from), blobsAt(corner, to));
  const Vector3 found = motion.at({corner.x + from[0], corner.y + from[1], corner.z + from[2]});
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(found[a], by[a], tolerance) << "axis " << a;
}

// The gradient of a blob of 4 voxels is that of its trilinear interpolation to about 3 %; the last
// iterations move by less than a tenth of a voxel.
TEST(MotionEstimate, FindsAMotionBetweenVoxels) { expectFound({}, {1.3, -0.7, 0.4}, 0.05); }

TEST(MotionEstimate, FindsAMotionOfMoreThanABrick) { expectFound({}, {9.0, 0.0, -2.0}, 0.3); }

TEST(MotionEstimate, IsTheSameFarFromTheOrigin) {
  expectFound({8'000'000, -8'000'000, 16}, {1.3, -0.7, 0.4}, 0.05);
}

TEST(MotionEstimate, FindsNoMotionWhereNothingMoves) { expectFound({}, {0, 0, 0}, 1e-9); }

TEST(MotionEstimate, FindsNoMotionInEmptyVolumes) {
  const MotionField motion = estimateMotion(SparseVolume(), SparseVolume());
  EXPECT_EQ(motion.at({1.0, 2.0, 3.0}), Vector3());
}

TEST(MotionEstimate, FindsNoMotionOfConstants) {
  const auto constant = test::volumeOf({}, 2, 1.0f, [](Coord) { return 1.0f; });
  EXPECT_EQ(estimateMotion(constant, constant).at({8.0, 8.0, 8.0}), Vector3());
}

TEST(MotionEstimate, MovesTheCentersOfAField) {
  Field field;
  field.chunks.resize(1);
  field.chunks[0].origin = {8, 8, 8};
  Ellipsoids& e = field.chunks[0].ellipsoids;
  e.resize(1);
  e.rotation[0][0] = 1.0f;
  const MotionField motion({{1, 1, 1}}, {{1.0, 2.0, 3.0}});
  e.center[0][0] = e.center[1][0] = e.center[2][0] = 4.0f;
  const Field there = moved(field, motion);
  EXPECT_FLOAT_EQ(there.chunks[0].ellipsoids.center[0][0], 5.0f);
  EXPECT_FLOAT_EQ(there.chunks[0].ellipsoids.center[1][0], 6.0f);
  EXPECT_FLOAT_EQ(there.chunks[0].ellipsoids.center[2][0], 7.0f);
}

}  // namespace
}  // namespace esvr::convert
