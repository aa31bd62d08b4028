// Plan: the extremes of three ellipsoids are known by hand, and their centers are found in the chunks
// that hold them.

#include "field/extreme_ellipsoids.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "field/random_field.h"

namespace esvr {
namespace {

TEST(ExtremeEllipsoids, AreThoseOfTheEllipsoids) {
  Field field = test::randomField({.count = 3, .kappa = 4.0f});
  Ellipsoids& e = field.chunks[0].ellipsoids;
  e.logScale = {std::vector{0.0f, std::log(0.1f), 1.0f},
                {0.0f, std::log(100.0f), 1.0f},
                {std::log(300.0f), 0.0f, 1.0f}};
  e.intensity = {1.0f, -3.0f, 0.5f};
  const FieldExtremes all = extremesOf(field);
  EXPECT_NEAR(all.smallestScale, 0.1, 1e-7);
  EXPECT_NEAR(all.largestScale, 300.0, 1e-3);
  EXPECT_NEAR(all.largestAspect, 1000.0, 1e-2);
  EXPECT_NEAR(all.largestCondition, 1e6, 20.0);
  EXPECT_EQ(all.lowestKappa, 4.0);
  EXPECT_EQ(all.highestKappa, 4.0);
  EXPECT_EQ(all.smallestIntensity, 0.5);
  EXPECT_EQ(all.largestIntensity, 3.0);
  e.kappa = {-1.0f, 2.0f, 7.0f};
  EXPECT_EQ(extremesOf(field).lowestKappa, -1.0);
  EXPECT_EQ(extremesOf(field).highestKappa, 7.0);
}

TEST(ExtremeEllipsoids, HaveCentersInIndexSpace) {
  Field field = test::randomField({.count = 3, .extent = 1.0, .origin = {100, 0, -8}});
  field.chunks.push_back(
      test::randomField({.count = 1, .extent = 1.0, .intensity = 0.0, .origin = {5000, 8, 8}})
          .chunks[0]);
  for (Chunk& chunk : field.chunks)
    for (auto& center : chunk.ellipsoids.center) std::ranges::fill(center, 2.6f);
  Ellipsoids& first = field.chunks[0].ellipsoids;
  for (auto& scale : field.chunks[1].ellipsoids.logScale) scale[0] = 3.0f;
  for (auto& scale : first.logScale) std::ranges::fill(scale, 0.0f);
  first.logScale[2] = {0.0f, -1.0f, 0.5f};  // the second one is the smallest, and the longest
  const Coord inFirst{103, 3, -5}, inSecond{5003, 11, 11};
  EXPECT_THAT(centersOfExtremes(field), testing::ElementsAre(inFirst, inSecond, inFirst, inFirst))
      << "smallest scale, largest scale, aspect ratio, intensity";
  EXPECT_TRUE(centersOfExtremes({}).empty());
}

}  // namespace
}  // namespace esvr
