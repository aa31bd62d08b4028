// Plan: estimates are upper bounds of what the lists of an evaluation hold. They are refined if
// they seem too large, and take no time for supports of any size. Work that is too large is refused
// before it begins.
#include "esvr/field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/device.h"
#include "esvr/error.h"
#include "field/evaluate.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

Field ballOf(float logScale, float center = 0.0f) {
  Field field;
  field.chunks.resize(1);
  Ellipsoids& e = field.chunks[0].ellipsoids;
  e.resize(1);
  for (auto& c : e.center) c[0] = center;
  for (auto& s : e.logScale) s[0] = logScale;
  e.rotation[0][0] = 1.0f;
  e.intensity[0] = 1.0f;
  return field;
}

TEST(WorkEstimate, IsABound) {
  for (const double smallest : {0.3, 4.0}) {
    const Field field = test::randomField({.count = 200, .smallest = smallest, .aspect = 20.0});
    const auto bricks = reachedBricks(field);
    const WorkEstimate estimate = estimateWork(field);
    EXPECT_GE(estimate.bricks, double(bricks.size()));
    EXPECT_GE(estimate.pairs, double(planEvaluation(field, bricks).pairs.pairCount()));
  }
}

TEST(WorkEstimate, CountsBricksOnceWhereItSeemsTooLarge) {
  const Field field = test::randomField({.count = 500, .smallest = 6.0, .aspect = 2.0});
  const double bricks = double(reachedBricks(field).size());
  const WorkEstimate rough = estimateWork(field);
  EXPECT_GT(rough.bricks, bricks);
  EXPECT_EQ(estimateWork(field, {.enough = rough.bytes() - 1.0}).bricks, bricks);
}

TEST(WorkEstimate, CountsOnlyWhatIsWanted) {
  const Field field = ballOf(3.0f);
  const Box part{{0, 0, 0}, {7, 15, 7}};
  EXPECT_LE(estimateWork(field, {.within = part}).bricks, 2.0);
  EXPECT_EQ(reachedBricks(field, part).size(), 2u);
}

TEST(WorkEstimate, OfAnyScaleIsKnownAtOnce) {
  EXPECT_GT(estimateWork(ballOf(6.0f), {.enough = 1e9}).bytes(), 1e9);
  EXPECT_GT(estimateWork(ballOf(32.0f), {.enough = 1e12}).bytes(), 1e24);
}

TEST(WorkEstimate, ListsThatNoMachineHoldsAreNotBegun) {
  EXPECT_THROW((void)reachedBricks(ballOf(20.0f)), MemoryExceeded);
  EXPECT_THROW((void)revoxelise(ballOf(32.0f), {}), MemoryExceeded);
}

TEST(WorkEstimate, AHugeSupportIsEvaluatedOnFewBricksAtOnce) {
  const std::vector<Coord> corners{{-800, 0, 8}, {0, 0, 0}, {80000, 8, 0}};
  std::vector<float> values(corners.size() * kBrickVoxels);
  evaluateBricks(ballOf(30.0f), corners, values);
  EXPECT_FLOAT_EQ(values.front(), 1.0f);
  EXPECT_FLOAT_EQ(values.back(), 1.0f);
}

// The difference of corner and origin has 33 bits.
TEST(WorkEstimate, AnOriginAtTheOtherEndOfTheIndexSpaceIsNoHarm) {
  Field field = ballOf(30.0f);
  field.chunks[0].origin = {Box::kMin, Box::kMin, Box::kMin};
  const std::vector<Coord> corners{{Box::kMax - 7, Box::kMax - 7, Box::kMax - 7}};
  std::vector<float> values(kBrickVoxels);
  evaluateBricks(field, corners, values);
  EXPECT_NEAR(values[0], 1.0f, 1e-3f);
}

TEST(WorkEstimate, BricksTooFarApartForAVolumeAreRefused) {
  Field field = ballOf(0.0f, -1.2e9f);
  field.chunks.push_back(ballOf(0.0f, 1.2e9f).chunks[0]);
  EXPECT_THAT([&] { (void)revoxelise(field, {}); },
              ThrowsMessage<RuntimeFailure>(HasSubstr("2^31")));
}

TEST(RequireWithinMemory, NamesBothNumbers) {
  EXPECT_NO_THROW(requireWithinMemory(100.0, 100, "it"));
  EXPECT_THAT([] { requireWithinMemory(28.4e9, 17'000'000'000, "grid 'smoke'"); },
              ThrowsMessage<MemoryExceeded>(
                  AllOf(HasSubstr("grid 'smoke'"), HasSubstr("28.4 GB"), HasSubstr("17 GB"))));
}

}  // namespace
}  // namespace esvr
