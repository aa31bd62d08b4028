// Plan: a field is evaluated batch by batch with limits on the pairs that are listed at once. The
// values are those of one evaluation, bit for bit, and all bricks are visited in order.

#include "field/brick_batches.h"

#include <gtest/gtest.h>

#include <vector>

#include "esvr/field.h"
#include "field/random_field.h"

namespace esvr {
namespace {

class BrickBatches : public testing::TestWithParam<double> {};

TEST_P(BrickBatches, HaveTheValuesOfOneEvaluation) {
  const Field field = test::randomField({.count = 200, .extent = 120.0});
  const auto corners = reachedBricks(field);
  std::vector<float> expected(corners.size() * kBrickVoxels), values;
  evaluateBricks(field, corners, expected);
  std::vector<Coord> visited;
  forEachBatch(
      field, corners,
      [&](const BrickBatch& batch) {
        visited.insert(visited.end(), batch.corners.begin(), batch.corners.end());
        values.insert(values.end(), batch.all.begin(), batch.all.end());
      },
      GetParam());
  EXPECT_EQ(visited, corners);
  EXPECT_EQ(values, expected);
}

// With a limit of 1, there are batches of a single brick that has more pairs.
INSTANTIATE_TEST_SUITE_P(Limits, BrickBatches, testing::Values(1.0, 300.0, kMaxListedPairs));

TEST(BrickBatch, NoBricksAreNotVisited) {
  forEachBatch(test::randomField({}), {}, [](const BrickBatch&) { FAIL(); });
}

// The bricks of each thread are made unique from time to time, so that ellipsoids that reach the
// same bricks take no memory.
TEST(ReachedBricks, OfManyEqualEllipsoidsAreThoseOfOne) {
  const Field one = test::randomField({.count = 1, .smallest = 10.0, .aspect = 1.0});
  Field many = one;
  const std::size_t bricks = reachedBricks(one).size();
  for (std::size_t n = 0; n * bricks < std::size_t{5} << 20; ++n)
    many.chunks.push_back(one.chunks.front());
  EXPECT_EQ(reachedBricks(many), reachedBricks(one));
}

}  // namespace
}  // namespace esvr
