// Plan: ellipsoids come into as few chunks as float32 centers allow, each relative to its chunk.

#include "fit/export_field.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace esvr {
namespace {

using Center = std::array<double, 3>;

/// A ball with a scale of 1 and an intensity of 2 at each center.
Field exported(const std::vector<Center>& centers, const ExportFrame& frame = {}) {
  std::vector<Ellipsoid> ellipsoids(centers.size());
  for (std::size_t i = 0; i < centers.size(); ++i) {
    ellipsoids[i].center = centers[i];
    ellipsoids[i].L = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    ellipsoids[i].intensity = 2.0;
  }
  return exportField(ellipsoids, frame);
}

ExportFrame frameAt(Coord origin) {
  ExportFrame frame;
  frame.origin = origin;
  return frame;
}

constexpr double kChunkSide = kChunkExtent;

TEST(ExportField, KeepsCentersALittleBeforeTheOriginInOneChunk) {
  const Field field =
      exported({{-0.25, 3.0, 0.0}, {10.0, -7.5, kChunkSide - 1.0}}, frameAt({8, 16, 24}));
  ASSERT_EQ(field.chunks.size(), 1u);
  EXPECT_EQ(field.chunks[0].origin, (Coord{8, 16, 24}));
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  EXPECT_EQ(e.center[0], (std::vector<float>{-0.25f, 10.0f}));
  EXPECT_EQ(e.center[1], (std::vector<float>{3.0f, -7.5f}));
}

TEST(ExportField, DividesCentersThatAreTooFarForOneChunk) {
  const Field field = exported({{-0.25, 0.0, 0.0}, {5.0, 0.0, 0.0}, {kChunkSide + 1.5, 0.0, 0.0}},
                               frameAt({8, 0, 0}));
  ASSERT_EQ(field.chunks.size(), 3u);
  const std::array<float, 3> centers{float(kChunkSide) - 0.25f, 5.0f, 1.5f};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(field.chunks[c].origin, (Coord{8 + (int(c) - 1) * kChunkExtent, 0, 0}));
    EXPECT_EQ(field.chunks[c].ellipsoids.center[0], std::vector<float>{centers[c]});
  }
}

TEST(ExportField, MayHaveNoEllipsoids) { EXPECT_TRUE(exported({}).chunks.empty()); }

TEST(ExportField, GivesIntensitiesInUnitsOfTheGrid) {
  ExportFrame frame;
  frame.scale = 0.5;
  frame.background = 0.25f;
  const Field field = exported({{1.0, 1.0, 1.0}}, frame);
  EXPECT_EQ(field.background, 0.25f);
  EXPECT_EQ(field.chunks[0].ellipsoids.intensity, std::vector<float>{4.0f});
}

}  // namespace
}  // namespace esvr
