// Plan: exact layers give back every bit in the smallest form that can hold it. Bounded layers keep
// their bound for values of any scale. All halves have the values that IEEE 754 defines.

#include "esvr/voxel_layer.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "../fit/volumes.h"
#include "codec/voxel_values.h"
#include "esvr/error.h"

namespace esvr {
namespace {

bool sameBits(std::span<const float> a, std::span<const float> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  });
}

void expectExact(const SparseVolume& volume, VoxelForm form) {
  const VoxelLayer layer = exactLayer(volume);
  EXPECT_EQ(layer.form, form);
  const SparseVolume back = volumeOf(layer);
  EXPECT_TRUE(sameBits(back.values, volume.values));
  EXPECT_EQ(back.active, volume.active);
  EXPECT_EQ(back.bricks, volume.bricks);
  EXPECT_EQ(back.origin, volume.origin);
  EXPECT_EQ(largestError(volume, layer), 0.0);
}

/// A volume whose values are made from random numbers in [-1, 1].
SparseVolume made(const std::function<float(double)>& value) {
  test::Random random(11);
  return test::volumeOf({-8, 16, 800}, 3, 0.25f, [&](Coord) { return value(random(-1.0, 1.0)); });
}

TEST(ExactLayer, NoticesTheFewValuesOfEightBits) {
  expectExact(made([](double r) { return float(std::floor(r * 100)) * (1.0f / 255.0f); }),
              VoxelForm::kPalette);
}

TEST(ExactLayer, HoldsHalvesAsHalves) {
  // The values have mantissas of eleven bits over thirty octaves, including subnormal halves.
  expectExact(made([](double r) {
                return float(std::ldexp(std::floor(r * 1024), int(std::lround(r * 1e6)) % 15 - 9));
              }),
              VoxelForm::kHalf);
}

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

TEST(ExactLayer, HoldsAnyFloat) {
  int n = 0;
  const float extremes[] = {-0.0f, 0.0f, std::numeric_limits<float>::max(),
                            -std::numeric_limits<float>::max(),
                            std::numeric_limits<float>::denorm_min()};
  expectExact(made([&](double r) {
                return n++ % 3 == 0 ? extremes[std::size_t(n) % std::size(extremes)]
                                    : float(r * std::pow(10.0, 30.0 * r));
              }),
              VoxelForm::kFloat);
}

TEST(ExactLayer, KeepsActiveBackgroundAndInactiveValues) {
  SparseVolume volume = test::tubeVolume();
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    volume.active[b] = {};
    volume.active[b].set(int(b) % kBrickVoxels);
  }
  expectExact(volume, VoxelForm::kPalette);
}

TEST(BoundedLayer, KeepsSignsWithinItsBoundIfAsked) {
  const SparseVolume band = test::levelSetVolume();
  const auto changed = [&](RoundedSigns signs) {
    const VoxelLayer layer = boundedLayer(band, 0.4, Activity::kExact, signs);
    EXPECT_LE(largestError(band, layer), 0.4);
    int voxels = 0;
    for (std::size_t i = 0; i < layer.codes.size(); ++i)
      voxels += (layer.codes[i] < 0) != (band.values[i] < 0.0f);
    return voxels;
  };
  EXPECT_EQ(changed(RoundedSigns::kKept), 0);
  EXPECT_GT(changed(RoundedSigns::kMayChange), 0);
}

TEST(BoundedLayer, KeepsItsBoundAtAnyScale) {
  for (const double scale : {1e-30, 1.0, 1e4, 1e30})
    for (const double share : {0.1, 0.01, 1e-4})
      for (const Activity activity : {Activity::kAuto, Activity::kExact, Activity::kByValue}) {
        const SparseVolume volume = made([&](double r) { return float(r * scale); });
        const VoxelLayer layer = boundedLayer(volume, share * scale, activity);
        EXPECT_LE(largestError(volume, layer), share * scale);
        if (activity == Activity::kExact) {
          EXPECT_TRUE(layer.active == volume.active);
        }
      }
}

TEST(BoundedLayer, IsQuantisedWhereFloat32IsFinerThanTheBound) {
  const SparseVolume volume = made([](double r) { return float(r); });
  for (const double bound : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    const VoxelLayer layer = boundedLayer(volume, bound, Activity::kExact);
    EXPECT_EQ(layer.form, VoxelForm::kQuantised) << bound;
    EXPECT_LE(largestError(volume, layer), bound);
  }
}

// Bounds below, near and above the distance of halfs, which is 2^-11 for values from 0.5 to 1.
TEST(BoundedLayer, KeepsItsBoundAfterRoundingToHalfs) {
  const SparseVolume volume = made([](double r) { return codec::nearestHalf(float(r)); });
  for (const double bound : {1e-5, 1.2e-4, 2.4e-4, 3e-4, 4.8e-4, 4.9e-4, 7e-4, 1e-3, 0.0123, 0.2})
    for (const auto signs : {RoundedSigns::kMayChange, RoundedSigns::kKept}) {
      const VoxelLayer layer =
          boundedLayer(volume, bound, Activity::kExact, signs, nullptr, DecodedValues::kHalfs);
      SparseVolume halfs = volumeOf(layer);
      roundToHalfs(halfs);
      EXPECT_LE(largestDifference(volume, halfs), bound);
    }
  const VoxelLayer coarse = boundedLayer(volume, 3e-4, Activity::kExact, RoundedSigns::kMayChange,
                                         nullptr, DecodedValues::kHalfs);
  EXPECT_EQ(coarse.form, VoxelForm::kQuantised);
}

TEST(QuantisedLayer, HasNoValueBeyondFloat) {
  VoxelLayer layer = layerFrom(VoxelForm::kQuantised, (1 << 30) - kBrickVoxels);
  layer.divisor = double(1 << 30) / 3.5e38;
  EXPECT_TRUE(allFinite(layer));
  EXPECT_EQ(volumeOf(layer).values.back(), std::numeric_limits<float>::max());
}

TEST(BoundedLayer, ByValueMakesTheBackgroundInactive) {
  const SparseVolume volume = test::tubeVolume();
  const VoxelLayer layer = boundedLayer(volume, 0.2, Activity::kByValue);
  const SparseVolume back = volumeOf(layer);
  for (std::size_t b = 0; b < back.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      EXPECT_EQ(back.active[b].test(v), back.brickValues(b)[std::size_t(v)] != 0.0f);
}

// Nine tenths of the voxels are within the bound of the background.
TEST(BoundedLayer, KeepsTheOverlapUnlessItGoesByValue) {
  const SparseVolume volume = made([](double r) { return float(0.25 + std::pow(r, 9.0)); });
  for (const double bound : {0.3, 0.01, 1e-4}) {
    const VoxelLayer layer = boundedLayer(volume, bound, Activity::kAuto);
    ASSERT_EQ(layer.bricks, volume.bricks) << bound;
    EXPECT_TRUE(overlapOf(layer.active, volume.active).suffices()) << bound;
    EXPECT_LE(largestError(volume, layer), bound);
  }
  const VoxelLayer byValue = boundedLayer(volume, 0.3, Activity::kByValue);
  EXPECT_FALSE(overlapOf(byValue.active, volume.active).suffices());
}

// Inactive voxels have values, too. Those beyond the bound are kept, and stay inactive outside the
// box of the active voxels.
TEST(BoundedLayer, MakesNoVoxelOutsideTheActiveBoxActive) {
  SparseVolume volume = made([](double r) { return float(2.0 + r); });
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (std::size_t x = 0; x < 5; ++x) volume.active[b].words[x] = 0;
  for (const Activity activity : {Activity::kAuto, Activity::kExact, Activity::kByValue}) {
    const VoxelLayer layer = boundedLayer(volume, 0.01, activity);
    EXPECT_EQ(activeBox(volumeOf(layer)), activeBox(volume));
    EXPECT_LE(largestError(volume, layer), 0.01);
  }
}

TEST(BoundedLayer, IsExactWhereFloat32IsNoFinerThanTheBound) {
  const SparseVolume volume = made([](double r) { return float(1e8 + std::floor(r * 1e5)); });
  EXPECT_EQ(largestError(volume, boundedLayer(volume, 1e-3, Activity::kExact)), 0.0);
}

TEST(BoundedLayer, RefusesAnInvalidBound) {
  const SparseVolume volume = test::tubeVolume();
  for (const double bound : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW((void)boundedLayer(volume, bound, Activity::kExact), UsageError);
}

}  // namespace
}  // namespace esvr
