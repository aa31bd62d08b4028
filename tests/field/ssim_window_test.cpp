// Plan: the tests check the weights of the window, its sums against three nested loops over each
// window, halos against single look-ups, and dilation. Sums have the same bits for every support
// that contains the values.
//
// Tolerance of sums: values and the sum of the weights are at most 1, and there are 33 additions
// with an error of 1.1e-16 each, so 1e-14 suffices.

#include "field/ssim_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "field/random_field.h"

namespace esvr {
namespace {

TEST(SsimWindow, WeightsSumToOneAndFallAsAGaussian) {
  const auto w = ssimWeights();
  EXPECT_NEAR(std::accumulate(w.begin(), w.end(), 0.0), 1.0, 1e-15);
  EXPECT_NEAR(w[6] / w[5], std::exp(-1.0 / 4.5), 1e-15);
  EXPECT_EQ(w[0], w[10]);
}

TEST(SsimWindow, ClippedWeightsSumWhatTheBoxLeaves) {
  const SsimWindow window;
  const auto w = ssimWeights();
  EXPECT_NEAR(window.weightWithin(100, 0, 1000), 1.0, 1e-15);
  EXPECT_DOUBLE_EQ(window.weightWithin(7, 7, 7), w[5]);
  EXPECT_NEAR(window.weightWithin(0, 0, 1000), (1.0 + w[5]) / 2.0, 1e-15);
}

std::unique_ptr<HaloValues> randomHalo(const Box& support) {
  test::Random random(3);
  auto halo = std::make_unique<HaloValues>();
  for (int x = support.min.x; x <= support.max.x; ++x)
    for (int y = support.min.y; y <= support.max.y; ++y)
      for (int z = support.min.z; z <= support.max.z; ++z)
        (*halo)[std::size_t(haloOffset(x, y, z))] = random(-1.0, 1.0);
  return halo;
}

double directSum(const HaloValues& halo, Coord voxel) {
  const auto w = ssimWeights();
  double sum = 0.0;
  for (int x = 0; x < kSsimTaps; ++x)
    for (int y = 0; y < kSsimTaps; ++y)
      for (int z = 0; z < kSsimTaps; ++z)
        sum += w[std::size_t(x)] * w[std::size_t(y)] * w[std::size_t(z)] *
               halo[std::size_t(haloOffset(voxel.x + x, voxel.y + y, voxel.z + z))];
  return sum;
}

class SsimWindowSupport : public testing::TestWithParam<Box> {};

TEST_P(SsimWindowSupport, SumsAreThoseOfEachWindowAlone) {
  const auto halo = randomHalo(GetParam());
  SsimWindow window;
  BrickSums sums;
  window.sum(*halo, {GetParam(), kWholeBrick}, sums);
  for (int v = 0; v < kBrickVoxels; v += 7)
    EXPECT_NEAR(sums[std::size_t(v)], directSum(*halo, voxelLocal(v)), 1e-14) << v;
}

TEST_P(SsimWindowSupport, ALargerSupportGivesTheSameBits) {
  const auto halo = randomHalo(GetParam());
  SsimWindow used, window;
  BrickSums sums, whole;
  used.sum(*randomHalo(kWholeHalo), {kWholeHalo, kWholeBrick}, sums);  // leaves other sums behind
  used.sum(*halo, {GetParam(), kWholeBrick}, sums);
  window.sum(*halo, {kWholeHalo, kWholeBrick}, whole);
  EXPECT_EQ(sums, whole);
}

TEST_P(SsimWindowSupport, WindowsElsewhereSumToZero) {
  const auto halo = randomHalo(GetParam());
  SsimWindow window;
  BrickSums sums;
  window.sum(*halo, {GetParam(), kWholeBrick}, sums);
  const Box reached = windowsThatSee(GetParam());
  for (int v = 0; v < kBrickVoxels; ++v)
    EXPECT_EQ(sums[std::size_t(v)] != 0.0, reached.contains(voxelLocal(v))) << v;
}

TEST(SsimWindow, SumsOfFewVoxelsReadNoMoreThanTheySee) {
  const auto halo = randomHalo(kWholeHalo);
  const Box voxels{{2, 3, 0}, {4, 3, 7}}, seen = seenByWindows(voxels);
  SsimWindow window;
  BrickSums sums, whole;
  window.sum(*halo, {kWholeHalo, kWholeBrick}, whole);
  for (int i = 0; i < kHaloVoxels; ++i)
    if (!seen.contains({i / (kHaloSide * kHaloSide), i / kHaloSide % kHaloSide, i % kHaloSide}))
      (*halo)[std::size_t(i)] = std::numeric_limits<double>::quiet_NaN();
  window.sum(*halo, {kWholeHalo, voxels}, sums);
  for (int v = 0; v < kBrickVoxels; ++v)
    if (voxels.contains(voxelLocal(v))) {
      EXPECT_EQ(sums[std::size_t(v)], whole[std::size_t(v)]) << v;
    }
}

INSTANTIATE_TEST_SUITE_P(Boxes, SsimWindowSupport,
                         testing::Values(kWholeHalo, Box{{13, 0, 5}, {17, 17, 12}},
                                         Box{{5, 0, 13}, {12, 4, 17}}, Box{{0, 0, 0}, {0, 0, 0}},
                                         Box{{17, 17, 17}, {17, 17, 17}}, Box{}));

TEST(BrickHalo, HoldsTheBrickAndItsNeighbours) {
  const std::vector<Coord> bricks{{-1, -1, -1}, {0, 0, 0}, {-1, 0, 1}, {1, 0, -1}, {5, 5, 5}};
  const BrickIndex index(bricks);
  std::vector<float> values(bricks.size() * kBrickVoxels);
  std::iota(values.begin(), values.end(), 1.0f);
  const BricksAround around = bricksAround(index, {0, 0, 0});
  ValuesAround<float> arrays{};
  for (std::size_t i = 0; i < around.size(); ++i)
    if (around[i] != BrickIndex::kNone) arrays[i] = &values[around[i] * kBrickVoxels];
  const auto halo = std::make_unique<HaloValues>();
  halo->fill(-1.0);
  const Box seen{{0, 1, 0}, {17, 14, 17}};
  fillHalo(arrays, seen, *halo);
  for (int i = 0; i < kHaloVoxels; ++i) {
    const Coord at{i / (kHaloSide * kHaloSide) - kSsimRadius,
                   i / kHaloSide % kHaloSide - kSsimRadius, i % kHaloSide - kSsimRadius};
    const auto b = index.find(brickOf(at));
    double want = 0.0;
    if (b != BrickIndex::kNone)
      want = double(values[b * kBrickVoxels + std::size_t(voxelOffset(localOf(at)))]);
    if (!seen.contains(at + Coord{kSsimRadius, kSsimRadius, kSsimRadius})) want = -1.0;
    ASSERT_EQ((*halo)[std::size_t(i)], want) << toString(at);
  }
}

TEST(BrickHalo, SupportHoldsTheBoxesOfTheBricksAsFarAsWindowsReach) {
  const std::vector<Coord> bricks{{-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {0, -1, 0}};
  const BrickIndex index(bricks);
  const std::vector<Box> boxes{kWholeBrick, {{1, 2, 3}, {1, 2, 3}}, Box{}, {{0, 0, 0}, {7, 2, 7}}};
  // Nothing of the last brick lies within reach of (0, 0, 0), because it ends at y = -6.
  EXPECT_EQ(haloSupport(bricksAround(index, {0, 0, 0}), boxes), (Box{{0, 5, 5}, {6, 12, 16}}));
  EXPECT_EQ(haloSupport(bricksAround(index, {-2, 1, 0}), boxes), (Box{{13, 0, 5}, {17, 4, 12}}));
  EXPECT_TRUE(haloSupport(bricksAround(index, {0, 0, -2}), boxes).empty());
  EXPECT_TRUE(haloSupport(bricksAround(index, {9, 9, 9}), boxes).empty());
}

TEST(DilateBricks, AddsTheTwentySixNeighboursOnce) {
  const std::vector<Coord> one{{-1, 0, 4}};
  const auto grown = dilateBricks(one);
  EXPECT_EQ(grown.size(), 27u);
  EXPECT_EQ(grown.front(), (Coord{-2, -1, 3}));
  EXPECT_EQ(grown.back(), (Coord{0, 1, 5}));

  const std::vector<Coord> two{{0, 0, 0}, {0, 0, 1}};
  const auto both = dilateBricks(two);
  EXPECT_EQ(both.size(), 36u);
  EXPECT_TRUE(std::is_sorted(both.begin(), both.end()));
}

}  // namespace
}  // namespace esvr
