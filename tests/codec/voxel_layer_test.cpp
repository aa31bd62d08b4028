// Plan: all halves have the values that IEEE 754 defines, and rounding finds the nearest of them. Codes of any size
// have finite values.
//
// Exact layers give back every bit in the smallest form that can hold it. Bounded layers keep
// their bound for values of any scale.
//
// thriftyLayer lowers the sum of squared error and price of bits, as counted in the encoded
// file, on smooth and on noisy values. It moves codes by two steps at most, towards fewer bits, and
// changes nothing else. No code changes sign if signs are to be kept. A price of 0 and other forms
// than a lattice change nothing. It stops where the codes take more bytes than they may.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>

#include "codec/voxel_coder.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/quantised.h"
#include "fit/volumes.h"
#include "format/voxel_sections.h"

namespace esvr {
namespace {

double largestError(const SparseVolume& volume, const VoxelLayer& layer) {
  return largestDifference(volume, volumeOf(layer));
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

void expectExact(const SparseVolume& volume, VoxelForm form) {
  const VoxelLayer layer = exactLayer(volume);
  EXPECT_EQ(layer.form, form);
  EXPECT_EQ(test::volumeDifference(volumeOf(layer), volume), "");
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

// 4,096 voxels of about 2,300 values: a palette of them takes 9,200 bytes, and all halves take 8,192.
TEST(ExactLayer, HasNoPaletteThatTakesMoreThanItSaves) {
  test::Random random(11);
  const SparseVolume volume = test::volumeOf(
      {}, 2, 1.0f, [&](Coord) { return codec::nearestHalf(float(random(0.0, 60000.0))); });
  EXPECT_EQ(exactLayer(volume).form, VoxelForm::kPalette);
  const VoxelLayer smallest = smallestExactLayer(volume);
  EXPECT_EQ(smallest.form, VoxelForm::kHalf);
  EXPECT_EQ(largestError(volume, smallest), 0.0);
  EXPECT_LT(format::putVoxels(smallest).size(), format::putVoxels(exactLayer(volume)).size());
  const SparseVolume few = test::volumeOf({}, 2, 1.0f, [](Coord v) { return float(v.x % 3); });
  EXPECT_EQ(smallestExactLayer(few).form, VoxelForm::kPalette);
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
      for (const Activity activity : {Activity::kExact, Activity::kByValue}) {
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
          boundedLayer(volume, bound, Activity::kExact, signs, DecodedValues::kHalfs);
      SparseVolume halfs = volumeOf(layer);
      roundToHalfs(halfs);
      EXPECT_LE(largestDifference(volume, halfs), bound);
    }
  const VoxelLayer coarse =
      boundedLayer(volume, 3e-4, Activity::kExact, RoundedSigns::kMayChange, DecodedValues::kHalfs);
  EXPECT_EQ(coarse.form, VoxelForm::kQuantised);
}

TEST(BoundedLayer, ByValueMakesTheBackgroundInactiveButForTheBox) {
  const SparseVolume volume = test::tubeVolume();
  const Box box = activeBox(volume);
  const VoxelLayer layer = boundedLayer(volume, 0.2, Activity::kByValue);
  const SparseVolume back = volumeOf(layer);
  std::size_t kept = 0;
  for (std::size_t b = 0; b < back.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const bool isActive = back.active[b].test(v);
      const bool differs = back.brickValues(b)[std::size_t(v)] != 0.0f;
      EXPECT_TRUE(isActive || !differs);
      if (!isActive || differs) continue;
      EXPECT_NE(facesOf(box, back.brickCorner(b) + voxelLocal(v)), 0u);
      ++kept;
    }
  EXPECT_LE(kept, kMostBoxVoxels);
}

// All voxels at the faces are within the bound of the background; with the largest bound, all voxels.
TEST(BoundedLayer, KeepsTheActiveBox) {
  SparseVolume volume = made([](double r) { return float(0.25 + std::pow(r, 9.0)); });
  const Box box = activeBox(volume);
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      if (facesOf(box, volume.brickCorner(b) + voxelLocal(v)) != 0)
        volume.brickValues(b)[std::size_t(v)] = 0.25f;
  for (const double bound : {2.0, 0.3, 1e-4}) {
    const VoxelLayer layer = boundedLayer(volume, bound, Activity::kByValue);
    const SparseVolume back = volumeOf(layer);
    EXPECT_EQ(activeBox(back), box) << bound;
    EXPECT_LE(largestError(volume, layer), bound);
    if (bound == 2.0) {
      EXPECT_LE(activeVoxelCount(back), kMostBoxVoxels);
    }
  }
}

// Inactive voxels have values, too. Those beyond the bound are kept, and stay inactive outside the
// box of the active voxels.
TEST(BoundedLayer, MakesNoVoxelOutsideTheActiveBoxActive) {
  SparseVolume volume = made([](double r) { return float(2.0 + r); });
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (std::size_t x = 0; x < 5; ++x) volume.active[b].words[x] = 0;
  for (const Activity activity : {Activity::kExact, Activity::kByValue}) {
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
  for (const double bound : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW((void)boundedLayer(volume, bound, Activity::kExact), UsageError);
    EXPECT_THROW((void)nearestLayer(volume, bound, Activity::kExact), UsageError);
  }
}

// boundedLayer() decodes what it makes, and takes another lattice where a value misses the bound.
TEST(NearestLayer, IsTheFirstLatticeOfTheBound) {
  for (const double scale : {1e-30, 1.0, 1e30})
    for (const double share : {0.1, 0.01})
      for (const Activity activity : {Activity::kExact, Activity::kByValue})
        for (const RoundedSigns signs : {RoundedSigns::kMayChange, RoundedSigns::kKept}) {
          const SparseVolume volume = made([&](double r) { return float(r * scale); });
          const double bound = share * scale;
          const VoxelLayer nearest = nearestLayer(volume, bound, activity, signs);
          EXPECT_EQ(nearest, boundedLayer(volume, bound, activity, signs)) << scale << " " << share;
          EXPECT_EQ(nearest.form, VoxelForm::kQuantised);
        }
}

TEST(NearestLayer, MissesTheBoundByTheRoundingOfFloatsAtMost) {
  // The steps are a few times as wide as those of the floats.
  const SparseVolume volume = made([](double r) { return float(r); });
  const double bound = 0x1p-22;
  const VoxelLayer layer = nearestLayer(volume, bound, Activity::kExact);
  EXPECT_EQ(layer.form, VoxelForm::kQuantised);
  EXPECT_LE(largestError(volume, layer), bound + 0x1p-25);
}

TEST(NearestLayer, IsExactWhereFloat32IsNoFinerThanTheBound) {
  const SparseVolume volume = made([](double r) { return float(1e8 + std::floor(r * 1e5)); });
  EXPECT_EQ(largestError(volume, nearestLayer(volume, 1e-3, Activity::kExact)), 0.0);
}

constexpr double kBound = 0.02;

/// A wave with some noise, which quantising with kBound hides.
SparseVolume noisyWave(double noise) {
  test::Random random(7);
  return test::volumeOf({}, 4, 0.0f, [&](Coord v) {
    return float(1.0 + std::sin(0.2 * v.x) * std::cos(0.15 * v.y + 0.1 * v.z) +
                 noise * random(-1.0, 1.0));
  });
}

/// The squared error in squared steps of the lattice, with bits at a price.
double costOf(const SparseVolume& volume, const VoxelLayer& layer, double price) {
  double error = 0.0;
  for (std::size_t i = 0; i < layer.codes.size(); ++i)
    error += std::pow(double(volume.values[i]) * layer.divisor - double(layer.codes[i]), 2);
  return error + price * 8.0 * double(bytesAdded(makeStoredVoxels({}, volume, layer)));
}

class ThriftyLayer : public testing::TestWithParam<double> {
 protected:
  SparseVolume volume_ = noisyWave(GetParam());
  VoxelLayer nearest_ = boundedLayer(volume_, kBound, Activity::kExact);
};

TEST_P(ThriftyLayer, LowersErrorPlusPriceOfBits) {
  const double price = 0.1;  // near the theory's; far above it, the codes spoil later predictions
  const VoxelLayer layer = thriftyLayer(volume_, nearest_, {.bitPrice = price}).layer;
  EXPECT_LT(costOf(volume_, layer, price), costOf(volume_, nearest_, price));
}

TEST_P(ThriftyLayer, MovesCodesByTwoStepsAtMostAndNothingElse) {
  VoxelLayer layer = thriftyLayer(volume_, nearest_, {.bitPrice = 0.3}).layer;
  int moved = 0;
  for (std::size_t i = 0; i < layer.codes.size(); ++i) {
    const int steps = std::abs(layer.codes[i] - nearest_.codes[i]);
    ASSERT_LE(steps, 2);
    moved += steps > 0;
  }
  EXPECT_GT(moved, 0);
  layer.codes = nearest_.codes;
  EXPECT_EQ(layer, nearest_);
}

TEST(ThriftyLayerOfALevelSet, KeepsSignsIfAsked) {
  SparseVolume wave = noisyWave(0.03);
  for (float& v : wave.values) v -= 1.0f;
  const VoxelLayer nearest = boundedLayer(wave, kBound, Activity::kExact, RoundedSigns::kKept);
  const auto changed = [&](RoundedSigns signs) {
    const VoxelLayer layer = thriftyLayer(wave, nearest, {.bitPrice = 0.3, .signs = signs}).layer;
    int voxels = 0;
    for (std::size_t i = 0; i < layer.codes.size(); ++i)
      voxels += (layer.codes[i] < 0) != (wave.values[i] < 0.0f);
    return voxels;
  };
  EXPECT_EQ(changed(RoundedSigns::kKept), 0);
  EXPECT_GT(changed(RoundedSigns::kMayChange), 0);
}

TEST_P(ThriftyLayer, OfFreeBitsIsTheNearest) {
  EXPECT_EQ(thriftyLayer(volume_, nearest_, {.bitPrice = 0.0}).layer, nearest_);
}

TEST_P(ThriftyLayer, LeavesExactValuesAlone) {
  const VoxelLayer exact = exactLayer(volume_);
  EXPECT_EQ(thriftyLayer(volume_, exact, {.bitPrice = 0.3}).layer, exact);
}

TEST_P(ThriftyLayer, StopsAboveItsBytes) {
  const auto whole = thriftyLayer(volume_, nearest_, {.bitPrice = 0.1});
  EXPECT_FALSE(whole.tooMany);
  const std::uint64_t bytes = format::putVoxels(whole.layer).size();
  EXPECT_FALSE(thriftyLayer(volume_, nearest_, {.bitPrice = 0.1, .mostBytes = bytes}).tooMany);
  const auto part = thriftyLayer(volume_, nearest_, {.bitPrice = 0.1, .mostBytes = bytes / 2});
  ASSERT_TRUE(part.tooMany);
  EXPECT_GT(*part.tooMany, bytes / 2);
  EXPECT_NEAR(double(*part.tooMany), double(bytes), 0.3 * double(bytes))
      << "the volume is alike everywhere, but models have learned little in the first half";
}

TEST_P(ThriftyLayer, StopsAtOnceWithoutBytes) {
  EXPECT_GT(thriftyLayer(volume_, nearest_, {.bitPrice = 0.1, .mostBytes = 0}).tooMany, 0u);
}

INSTANTIATE_TEST_SUITE_P(Noise, ThriftyLayer, testing::Values(0.0, 0.03, 0.3));

}  // namespace

}  // namespace esvr
