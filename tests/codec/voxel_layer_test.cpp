// Plan: all halves have the values that IEEE 754 defines, and rounding finds the nearest of them. Codes of any size
// have finite values.

#include "esvr/quantised.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "codec/voxel_values.h"

namespace esvr {
namespace {

/// A layer of one brick whose voxels have the codes from `first` on, all active.
VoxelLayer layerFrom(VoxelForm form, std::int32_t first) {
  VoxelLayer layer;
  layer.form = form;
  layer.bricks = {{}};
  layer.active.resize(1);
  layer.vacant.resize(1);
  layer.active[0].setAll();
  for (int v = 0; v < kBrickVoxels; ++v) layer.codes.push_back(first + v);
  return layer;
}

/// The half with the bits n, by the definition in IEEE 754; the largest exponent counts as others.
double halfByDefinition(std::int32_t n) {
  const int exponent = n >> 10, mantissa = n & 1023;
  return exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
}

TEST(HalfLayer, HasTheValueOfEveryHalf) {
  for (std::int32_t first = 0; first < 0x8000; first += kBrickVoxels) {
    const SparseVolume volume = volumeOf(layerFrom(VoxelForm::kHalf, first));
    for (int v = 0; v < kBrickVoxels; ++v)
      ASSERT_EQ(double(volume.values[std::size_t(v)]), halfByDefinition(first + v)) << first + v;
  }
  const SparseVolume negative = volumeOf(layerFrom(VoxelForm::kHalf, -kBrickVoxels));
  for (int v = 0; v < kBrickVoxels; ++v)
    ASSERT_EQ(double(negative.values[std::size_t(v)]), -halfByDefinition(kBrickVoxels - 1 - v));
}

/// Tells what a rounding of `value` should be, by a search among all halfs.
float nearestByDefinition(double value) {
  double best = 0.0, least = HUGE_VAL;
  std::int32_t of = 0;
  for (std::int32_t n = 0; n < 0x7c00; ++n) {
    const double half = halfByDefinition(n), distance = std::abs(half - value);
    if (distance < least || (distance == least && of % 2 != 0))
      best = half, least = distance, of = n;
  }
  return float(best);
}

TEST(NearestHalf, IsTheNearestOfAllHalfs) {
  for (const float v :
       {0x1p-25f, 0x1.1p-24f, 0x1.8p-24f, 0x1.fffp-15f, 0x1.ffcp-15f, 0.1f, 1.0f, 0x1.002p0f,
        0x1.006p0f, 0x1.00201p0f, 2047.5f, 2049.0f, 2051.0f, 65504.0f, 65503.0f, 1e9f})
    EXPECT_EQ(codec::nearestHalf(v), nearestByDefinition(v)) << v;
  for (std::int32_t n = 0; n < 0x7c00; ++n) {
    const auto half = float(halfByDefinition(n));
    ASSERT_EQ(codec::nearestHalf(half), half);
    ASSERT_EQ(codec::nearestHalf(-half), -half);
  }
}

TEST(OrderOfHalf, CutsOffWhatIsBetweenTwoHalfs) {
  for (std::int32_t n = 0; n < 0x7c00; ++n) {
    const auto half = float(halfByDefinition(n));
    const float above = std::nextafter(half, 1e9f), below = std::nextafter(half, 0.0f);
    ASSERT_EQ(codec::orderOfHalf(half), n);
    ASSERT_EQ(codec::orderOfHalf(-half), -1 - n);
    ASSERT_EQ(codec::orderOfHalf(above), n);
    ASSERT_EQ(codec::orderOfHalf(below), std::max(n - 1, 0));
  }
  EXPECT_EQ(codec::orderOfHalf(1e30f), 0x7bff);
}

TEST(NearestHalf, StaysWithinTheHalfsAndOnItsSideOfZero) {
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float v : {65519.0f, 65520.0f, 1e30f, infinity}) {
    EXPECT_EQ(codec::nearestHalf(v), 65504.0f);
    EXPECT_EQ(codec::nearestHalf(-v), -65504.0f);
  }
  EXPECT_EQ(codec::nearestHalf(1e-20f), 0.0f);
  EXPECT_EQ(codec::nearestHalf(-1e-20f), -0x1p-24f);
}

TEST(AllFinite, LooksAtVoxelsThatAreNotVacant) {
  const auto infinity =
      std::int32_t(std::bit_cast<std::uint32_t>(std::numeric_limits<float>::infinity()));
  EXPECT_TRUE(allFinite(layerFrom(VoxelForm::kFloat, infinity - kBrickVoxels)));
  VoxelLayer layer = layerFrom(VoxelForm::kFloat, infinity - kBrickVoxels + 1);
  EXPECT_FALSE(allFinite(layer));
  layer.vacant[0].set(kBrickVoxels - 1);
  EXPECT_TRUE(allFinite(layer));
}

TEST(QuantisedLayer, HasNoValueBeyondFloat) {
  VoxelLayer layer = layerFrom(VoxelForm::kQuantised, (1 << 30) - kBrickVoxels);
  layer.divisor = double(1 << 30) / 3.5e38;
  EXPECT_TRUE(allFinite(layer));
  EXPECT_EQ(volumeOf(layer).values.back(), std::numeric_limits<float>::max());
}

}  // namespace
}  // namespace esvr
