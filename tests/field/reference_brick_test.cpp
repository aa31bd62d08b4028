// Plan: the float64 sum of a brick, which leaves out ellipsoids that are far away, is compared with the
// definition. The counts of terms and the bound are those of a field that is known by hand.

#include "field/reference_brick.h"

#include <gtest/gtest.h>

#include "esvr/field.h"
#include "field/random_field.h"

namespace esvr {
namespace {

// Both sums are in float64 and have the same terms, in the same order.
TEST(ReferenceBrick, IsTheDefinition) {
  Field field = test::randomField({.count = 40, .aspect = 30.0});
  field.background = 0.25f;
  field.chunks.push_back(
      test::randomField({.count = 10, .origin = {-5, 3, 9}, .seed = 3}).chunks[0]);
  const ReferenceField reference(field);
  for (const Coord corner : {Coord{0, 0, 0}, Coord{16, 24, 8}, Coord{-8, 0, 32}}) {
    const ReferenceBrick brick = reference.evaluate(corner);
    for (int v = 0; v < kBrickVoxels; v += 7)
      EXPECT_NEAR(field.background + brick.voxels[std::size_t(v)].sum,
                  evaluateReference(field, corner + voxelLocal(v)), 1e-14);
  }
}

TEST(ReferenceBrick, ListsWhatReachesIt) {
  Field field = test::randomField({.count = 1, .extent = 1.0, .smallest = 1.0, .aspect = 1.0});
  field.chunks[0].ellipsoids.intensity[0] = -2.0f;
  const ReferenceField reference(field);
  const ReferenceBrick near = reference.evaluate({0, 0, 0}), far = reference.evaluate({80, 0, 0});
  EXPECT_EQ(near.ellipsoids, 1u);
  EXPECT_EQ(near.largestIntensity, 2.0);
  EXPECT_EQ(near.voxels[0].count, 1u);
  EXPECT_EQ(near.voxels[0].magnitudes, -near.voxels[0].sum);
  EXPECT_EQ(near.voxels[std::size_t(voxelOffset({7, 7, 7}))].count, 0u);
  EXPECT_EQ(far.ellipsoids, 0u);
  EXPECT_EQ(far.voxels[0].sum, 0.0);
}

// A GPU rounds to units of the largest intensity too.
TEST(ReferenceBrick, HasALargerBoundForIntegerSums) {
  const Field field = test::randomField({.count = 40});
  const ReferenceField reference(field);
  const ReferenceBrick brick = reference.evaluate({16, 16, 16});
  EXPECT_GT(reference.bound(brick, 0, {.integerSums = true}), reference.bound(brick, 0, {}));
  EXPECT_GT(reference.bound(brick, 0, {}), 0.0);
}

}  // namespace
}  // namespace esvr
