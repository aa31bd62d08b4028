// Plan: (1) random sparse volumes are compared with plain dense float64 loops: the bricks of both
// sides differ, the box cuts bricks, coordinates are negative, and backgrounds are not zero; (2)
// results that are known in closed form; (3) the bits do not depend on the number of threads; (4)
// the time depends on the bricks and not on the box; (5) scale, position, and refused input.
//
// Tolerance of (1): sums of n < 5e4 float64 terms in two orders differ by less than n eps = 1e-11
// of the sum of the terms' magnitudes. Squared errors are positive. Values are of order 1, so
// masses may differ by 1e-11 * n.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "esvr/metrics.h"
#include "metrics/dense_reference.h"
#include "metrics/volumes.h"
#include "support/on_threads.h"

namespace esvr {
namespace {

using test::movedBy;
using test::randomVolume;
using test::volumeOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kSumTolerance = 1e-11;
constexpr Box kBox{{-13, -16, -3}, {9, 5, 17}};  // cuts bricks and extends beyond them
constexpr Box kEverywhere{{-32, -32, -32}, {31, 31, 31}};

struct RandomCase {
  std::uint64_t seed;
  float backgroundA, backgroundB;
};

class AgainstDense : public testing::TestWithParam<RandomCase> {};

TEST_P(AgainstDense, everyMetricAgreesWithThePlainLoops) {
  const RandomCase c = GetParam();
  const auto a = randomVolume({.seed = c.seed, .background = c.backgroundA});
  const auto b = randomVolume(
      {.seed = c.seed + 100, .brickRange = 3, .brickShare = 0.05, .background = c.backgroundB});
  const double peak = 1.25;
  const auto got = compareVolumes(a, b, {.box = kBox, .peak = peak});
  const auto want = test::denseMetrics(a, b, kBox, kEverywhere, peak);

  EXPECT_EQ(got.boxVoxels, want.boxVoxels);
  EXPECT_EQ(got.activeVoxels, want.activeVoxels);
  EXPECT_EQ(got.maxError, want.maxError);
  EXPECT_EQ(got.p999Error, want.p999Error);
  EXPECT_EQ(got.iou, want.iou);
  EXPECT_NEAR(got.mseBox, want.mseBox, kSumTolerance * want.mseBox);
  EXPECT_NEAR(got.mseActive, want.mseActive, kSumTolerance * want.mseActive);
  EXPECT_NEAR(got.psnrBox, want.psnrBox, 1e-9);  // kSumTolerance * 10 / ln 10, and rounding
  EXPECT_NEAR(got.psnrActive, want.psnrActive, 1e-9);
  EXPECT_EQ(got.psnrBox, psnrOverBox(a, b, {.box = kBox, .peak = peak}));
  EXPECT_NEAR(got.massReference, want.massReference, kSumTolerance * want.boxVoxels);
  EXPECT_NEAR(got.massCandidate, want.massCandidate, kSumTolerance * want.boxVoxels);

  const Coord at = got.maxErrorAt;
  EXPECT_TRUE(kBox.contains(at));
  EXPECT_EQ(std::abs(double(valueAt(a, at)) - double(valueAt(b, at))), got.maxError);
}

INSTANTIATE_TEST_SUITE_P(Random, AgainstDense,
                         testing::Values(RandomCase{1, 0.0f, 0.0f}, RandomCase{2, 0.0f, 0.0f},
                                         RandomCase{3, 1.0f, 1.0f}, RandomCase{4, 0.0f, 0.25f},
                                         RandomCase{5, -3.0f, 3.0f}, RandomCase{6, 5.0f, 0.0f}));

TEST(CompareVolumes, identicalVolumesHaveNoError) {
  const auto a = randomVolume({.seed = 7, .background = 0.5f});
  const auto m = compareVolumes(a, a, {.ssim = true});
  EXPECT_EQ(m.psnrBox, std::numeric_limits<double>::infinity());
  EXPECT_EQ(m.psnrActive, std::numeric_limits<double>::infinity());
  EXPECT_EQ(m.mseBox, 0.0);
  EXPECT_EQ(m.mseActive, 0.0);
  EXPECT_EQ(m.maxError, 0.0);
  EXPECT_EQ(m.p999Error, 0.0);
  EXPECT_EQ(m.iou, 1.0);
  EXPECT_EQ(m.massReference, m.massCandidate);
  ASSERT_TRUE(m.ssim.has_value());
  EXPECT_NEAR(*m.ssim, 1.0, 1e-15);  // the quotients are exact; only their sum is rounded
}

TEST(CompareVolumes, oneVoxelHasTheAnswerOfTheFormula) {
  const auto a = volumeOf({{{3, 4, 5}, 2.0f}});
  const auto b = volumeOf({{{3, 4, 5}, 1.5f}});
  const auto m = compareVolumes(a, b, {.box = Box{{0, 0, 0}, {9, 9, 9}}});
  EXPECT_EQ(m.peak, 2.0);
  EXPECT_EQ(m.boxVoxels, 1000.0);
  EXPECT_DOUBLE_EQ(m.mseBox, 0.25 / 1000.0);
  EXPECT_DOUBLE_EQ(m.mseActive, 0.25);
  EXPECT_DOUBLE_EQ(m.psnrBox, 10.0 * std::log10(4.0 / 0.00025));
  EXPECT_EQ(m.maxErrorAt, (Coord{3, 4, 5}));
  EXPECT_EQ(m.massReference, 2.0);
  EXPECT_EQ(m.massCandidate, 1.5);
  EXPECT_FALSE(m.ssim.has_value());
}

TEST(CompareVolumes, activeVoxelsOnOneSideOnlyLowerTheOverlap) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}, {{1, 0, 0}, 1.0f}, {{40, 0, 0}, 1.0f}});
  const auto b = volumeOf({{{1, 0, 0}, 1.0f}, {{-40, 0, 0}, 1.0f}});
  EXPECT_DOUBLE_EQ(compareVolumes(a, b).iou, 1.0 / 4.0);
}

TEST(CompareVolumes, theDefaultBoxIsTheReferencesActiveBox) {
  const auto a = volumeOf({{{-5, 0, 2}, 1.0f}, {{4, 7, 9}, 3.0f}});
  const auto b = volumeOf({{{100, 100, 100}, 50.0f}});
  const auto m = compareVolumes(a, b);
  EXPECT_EQ(m.boxVoxels, 10.0 * 8.0 * 8.0);
  EXPECT_EQ(m.maxError, 3.0) << "voxels outside the box do not count";
  EXPECT_EQ(m.p999Error, 50.0) << "but the percentile is over all active voxels";
}

/// The level set of a sphere. Voxels whose distance is `band` or more are inactive.
SparseVolume sphere(float band) {
  constexpr float kBackground = 3.0f;
  constexpr int kReach = 4;  // bricks
  std::vector<BrickInput> bricks;
  for (int n = 0; n < 8 * kReach * kReach * kReach; ++n) {
    const Coord place{n % (2 * kReach), n / (2 * kReach) % (2 * kReach), n / (4 * kReach * kReach)};
    BrickInput brick{(place - Coord{kReach, kReach, kReach}) * kBrickSide, {}, {}};
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = brick.corner + voxelLocal(v);
      const auto distance = float(std::hypot(at.x, at.y, at.z)) - 26.0f;
      const bool active = std::abs(distance) < band;
      brick.values[std::size_t(v)] = active ? distance : std::copysign(kBackground, distance);
      if (active) brick.active.set(v);
    }
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), kBackground);
}

TEST(CompareVolumes, theInsideOfALevelSetNeedsNoBricks) {
  const SparseVolume wide = sphere(3.0f), narrow = sphere(2.0f);
  ASSERT_LT(narrow.brickCount(), wide.brickCount());
  const Box box{{-32, -32, -32}, {31, 31, 31}};
  EXPECT_LE(compareVolumes(wide, narrow, {.box = box}).maxError, 1.0);
  EXPECT_LE(compareVolumes(narrow, wide, {.box = box}).maxError, 1.0);
}

TEST(CompareVolumes, differentBackgroundsCountInEmptySpace) {
  const Box box{{0, 0, 0}, {15, 15, 15}};
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}}, 0.0f);
  const auto b = volumeOf({{{0, 0, 0}, 1.0f}}, 0.5f);
  const auto m = compareVolumes(a, b, {.box = box});
  EXPECT_DOUBLE_EQ(m.mseBox, 0.25 * (4096.0 - 1.0) / 4096.0);
  EXPECT_EQ(m.maxError, 0.5);
  EXPECT_EQ(m.maxErrorAt, (Coord{0, 0, 1}));
  EXPECT_EQ(m.massReference, 1.0);
  EXPECT_EQ(m.massCandidate, 0.5) << "inactive voxels hold the background and add nothing";
}

TEST(CompareVolumes, theLargestErrorIsFoundInSpaceWithoutBricks) {
  // The bricks fill all of the box but its last brick. Errors in them are smaller than outside.
  const auto value = [](Coord) { return 1.0f; };
  const auto a = volumeOf(Box{{8, 8, 8}, {23, 23, 15}}, value, 0.0f);
  const auto b = volumeOf(Box{{8, 8, 8}, {23, 23, 15}}, value, 2.0f);
  const auto m = compareVolumes(a, b, {.box = Box{{9, 9, 9}, {22, 22, 20}}});
  EXPECT_EQ(m.maxError, 2.0);
  EXPECT_EQ(m.maxErrorAt, (Coord{9, 9, 16}));
}

TEST(CompareVolumes, aBoxAwayFromAllVoxelsHoldsBackgroundOnly) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}});
  const auto b = volumeOf({{{0, 0, 0}, 2.0f}}, 0.5f);
  const Box box{{1000, 1000, 1000}, {1003, 1003, 1003}};
  const auto m = compareVolumes(a, b, {.box = box});
  EXPECT_EQ(m.mseBox, 0.25);
  EXPECT_EQ(m.maxErrorAt, box.min);
  EXPECT_EQ(m.mseActive, 1.0);
}

TEST(CompareVolumes, sumsAreTheSameBitsForAnyNumberOfThreads) {
  const auto a = randomVolume({.seed = 11, .brickRange = 5, .brickShare = 0.6});
  const auto b = randomVolume({.seed = 12, .brickRange = 5, .brickShare = 0.6});
  const auto compare = [&] { return compareVolumes(a, b, {.ssim = true}); };
  const auto one = test::onThreads(1, compare);
  for (std::size_t threads : {2u, 3u, 7u}) {
    const auto many = test::onThreads(threads, compare);
    EXPECT_EQ(one.mseBox, many.mseBox);
    EXPECT_EQ(one.mseActive, many.mseActive);
    EXPECT_EQ(one.massCandidate, many.massCandidate);
    EXPECT_EQ(one.maxErrorAt, many.maxErrorAt);
    EXPECT_EQ(one.p999Error, many.p999Error);
    EXPECT_EQ(*one.ssim, *many.ssim);
  }
}

TEST(CompareVolumes, aHugeBoxCostsNothing) {
  const int far = 10'000'000;
  const auto a = volumeOf({{{-far, -far, -far}, 1.0f}, {{far, far, far}, 1.0f}});
  const auto b = volumeOf({{{-far, -far, -far}, 1.0f}}, 0.5f);
  const auto m = compareVolumes(a, b, {.ssim = true});  // a dense loop would take years
  const double side = 2.0 * far + 1.0;
  EXPECT_EQ(m.boxVoxels, side * side * side);
  EXPECT_NEAR(m.mseBox, 0.25, 1e-12);
  EXPECT_EQ(m.maxError, 0.5);
}

TEST(CompareVolumes, placeDoesNotMatter) {
  const auto a = randomVolume({.seed = 21}), b = randomVolume({.seed = 22});
  const Coord by{8 << 20, -(8 << 20), 8};
  const auto here = compareVolumes(a, b, {.ssim = true});
  const auto there = compareVolumes(movedBy(a, by), movedBy(b, by), {.ssim = true});
  EXPECT_EQ(here.mseBox, there.mseBox);
  EXPECT_EQ(here.p999Error, there.p999Error);
  EXPECT_EQ(here.maxErrorAt + by, there.maxErrorAt);
  EXPECT_EQ(*here.ssim, *there.ssim);
}

class Scaled : public testing::TestWithParam<float> {};

TEST_P(Scaled, valuesScaleWithoutOverflowOrUnderflow) {
  const float s = GetParam();
  const auto a = volumeOf({{{0, 0, 0}, s}, {{3, 3, 3}, s / 2}});
  const auto b = volumeOf({{{0, 0, 0}, s}, {{3, 3, 3}, s / 4}});
  const auto m = compareVolumes(a, b, {.ssim = true});
  EXPECT_NEAR(m.psnrActive, 10.0 * std::log10(2.0 * 16.0), 1e-5);  // s / 4 is rounded to float
  EXPECT_NEAR(m.mseBox / (double(s) * s), 1.0 / 16.0 / 64.0, 1e-8);
  EXPECT_TRUE(std::isfinite(*m.ssim));
}
INSTANTIATE_TEST_SUITE_P(Values, Scaled, testing::Values(1e-30f, 1.0f, 1e30f, 3e38f));

TEST(CompareVolumes, refusesAReferenceWithoutActiveVoxels) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}});
  EXPECT_THROW((void)compareVolumes(SparseVolume{}, a), BadInput);
  EXPECT_THROW((void)compareVolumes(SparseVolume{}, a, {.peak = 1.0}), BadInput);
}

TEST(CompareVolumes, comparesWithACandidateWithoutBricks) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}});
  const auto m = compareVolumes(a, SparseVolume{});
  EXPECT_EQ(m.mseActive, 1.0);
  EXPECT_EQ(m.iou, 0.0);
}

TEST(CompareVolumes, refusesAPeakThatIsNotPositive) {
  const auto a = volumeOf({{{0, 0, 0}, -1.0f}});
  EXPECT_EQ(compareVolumes(a, a, {.peak = 1.0}).maxError, 0.0);
  EXPECT_THROW((void)compareVolumes(a, a, {.peak = 0.0}), UsageError);
  EXPECT_THROW((void)compareVolumes(a, a, {.peak = std::nan("")}), UsageError);
}

TEST(CompareVolumes, takesTheRangeAsPeakOfOneSignAndTheLargestMagnitudeOfTwo) {
  EXPECT_EQ(peakOf(volumeOf({{{0, 0, 0}, -9.0f}, {{1, 0, 0}, 2.0f}})), 9.0);
  EXPECT_EQ(peakOf(volumeOf({{{0, 0, 0}, 101325.0f}, {{1, 0, 0}, 101365.0f}})), 40.0);
  EXPECT_EQ(peakOf(volumeOf({{{0, 0, 0}, -3.0f}, {{1, 0, 0}, -1.0f}})), 3.0);
  EXPECT_EQ(peakOf(volumeOf({{{0, 0, 0}, 0.0f}})), 1.0);
  const auto negative = volumeOf({{{0, 0, 0}, -4.0f}});
  EXPECT_EQ(compareVolumes(negative, negative).peak, 4.0);
}

TEST(CompareVolumes, measuresARangeForPercentagesWithoutTheBackground) {
  EXPECT_EQ(valueRangeOf(volumeOf({{{0, 0, 0}, 0.25f}, {{1, 0, 0}, 1.0f}})), 0.75);
  EXPECT_EQ(valueRangeOf(volumeOf({{{0, 0, 0}, 5.0f}})), 0.0);
}

TEST(CompareVolumes, callsAnInfiniteValueBadInputAndNoWrongPeak) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}, {{1, 0, 0}, std::numeric_limits<float>::infinity()}});
  EXPECT_THROW((void)compareVolumes(a, a), BadInput);
}

TEST(CompareVolumes, refusesAnEmptyBox) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}});
  EXPECT_THROW((void)compareVolumes(a, a, {.box = Box{{1, 1, 1}, {0, 5, 5}}}), UsageError);
}

TEST(CompareVolumes, namesTheFirstVoxelThatIsNotFinite) {
  auto a = volumeOf({{{-9, 2, 3}, 1.0f}, {{5, 5, 5}, 1.0f}});
  auto b = a;
  b.brickValues(0)[std::size_t(voxelOffset(localOf({-9, 2, 3})))] = NAN;
  b.brickValues(1)[0] = INFINITY;
  EXPECT_THAT([&] { (void)compareVolumes(a, b); },
              ThrowsMessage<BadInput>(HasSubstr("(-9, 2, 3)")));
}

TEST(Psnr, isInfiniteWithoutError) {
  EXPECT_EQ(psnr(0.0, 1.0), std::numeric_limits<double>::infinity());
}

TEST(Psnr, followsItsFormula) {
  EXPECT_DOUBLE_EQ(psnr(1e-4, 1.0), 40.0);
  EXPECT_DOUBLE_EQ(psnr(1e-60, 1e-30), 0.0);
  EXPECT_NEAR(psnr(0.01, 255.0), 20.0 * std::log10(2550.0), 1e-12);
}

}  // namespace
}  // namespace esvr
