// Plan: components get the bricks and the active voxels of all of them, with their own backgrounds,
// also if one has no brick; lengths are those of the vectors voxel by voxel.

#include "esvr/vector_grid.h"

#include <gtest/gtest.h>

#include <cmath>

namespace esvr {
namespace {

/// A volume with one active voxel.
SparseVolume voxel(Coord at, float value, float background) {
  BrickInput brick{brickOf(at) * kBrickSide, {}, {}};
  brick.values.fill(background);
  brick.values[std::size_t(voxelOffset(localOf(at)))] = value;
  brick.active.set(voxelOffset(localOf(at)));
  return makeVolume({brick}, background);
}

constexpr Coord kLow{-3, 1, 2}, kHigh{20, 1, 2};

VectorVolume apart() {
  SparseVolume none;
  none.background = 2.0f;
  return {voxel(kLow, 3.0f, 0.0f), voxel(kHigh, 4.0f, -1.0f), none};
}

TEST(Vectors, AreAlignedToTheBricksAndActiveVoxelsOfAllComponents) {
  const VectorVolume vectors = aligned(apart());
  for (const SparseVolume& volume : vectors) {
    checkInvariants(volume);
    EXPECT_EQ(volume.origin, (Coord{-8, 0, 0}));
    EXPECT_EQ(volume.bricks, vectors[0].bricks);
    EXPECT_EQ(activeVoxelCount(volume), 2u);
  }
  EXPECT_EQ(valueAt(vectors[0], kLow), 3.0f);
  EXPECT_EQ(valueAt(vectors[0], kHigh), 0.0f);
  EXPECT_EQ(valueAt(vectors[1], kLow), -1.0f);
  EXPECT_EQ(valueAt(vectors[2], kHigh), 2.0f);
}

TEST(Vectors, HaveLengths) {
  const SparseVolume lengths = magnitudeOf(apart());
  EXPECT_FLOAT_EQ(valueAt(lengths, kLow), std::sqrt(9.0f + 1.0f + 4.0f));
  EXPECT_FLOAT_EQ(valueAt(lengths, kHigh), std::sqrt(16.0f + 4.0f));
  EXPECT_FLOAT_EQ(lengths.background, std::sqrt(1.0f + 4.0f));
}

TEST(Vectors, WhoseSquaresExceedFloatHaveLengths) {
  const VectorVolume vectors{voxel(kLow, 3e30f, 0.0f), voxel(kLow, 4e30f, 0.0f), SparseVolume{}};
  EXPECT_FLOAT_EQ(valueAt(magnitudeOf(vectors), kLow), 5e30f);
}

TEST(Vectors, WithoutVoxelsHaveNone) { EXPECT_EQ(magnitudeOf({}).brickCount(), 0u); }

TEST(Vectors, NameTheirComponents) { EXPECT_EQ(componentName("v[1]", 2), "v[1].z"); }

}  // namespace
}  // namespace esvr
