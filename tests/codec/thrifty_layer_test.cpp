// Plan: thriftyLayer lowers the sum of squared error and price of bits, as counted in the encoded
// file, on smooth and on noisy values. It moves codes by two steps at most, towards fewer bits, and
// changes nothing else. No code changes sign if signs are to be kept. A price of 0 and other forms
// than a lattice change nothing. It stops where the codes take more bytes than they may.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "../fit/volumes.h"
#include "esvr/grid_coding.h"
#include "esvr/voxel_layer.h"
#include "format/voxel_section.h"

namespace esvr {
namespace {

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
