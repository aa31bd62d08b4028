// Plan: (1) random sparse volumes are compared with plain dense float64 loops: the bricks of both
// sides differ, the box cuts bricks, coordinates are negative, and backgrounds are not zero; (2)
// results that are known in closed form; (3) the bits do not depend on the number of threads; (4)
// the time depends on the bricks and not on the box; (5) scale, position, and refused input; (6) the
// metrics agree with those that scikit-image and numpy compute for the same voxels as arrays
// (make_metrics_fixture.py; SSIM and FLIP have tests of their own).
// The errors of vectors and of temporal differences are compared with figures that are computed by
// hand, and the signs of level sets with voxels whose sign is changed.
//
// Tolerance of (1): sums of n < 5e4 float64 terms in two orders differ by less than n eps = 1e-11
// of the sum of the terms' magnitudes. Squared errors are positive. Values are of order 1, so
// masses may differ by 1e-11 * n.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "esvr/metrics.h"
#include "fit/volumes.h"
#include "metrics/volumes.h"
#include "support/machine.h"
#include "support/messages.h"

namespace esvr {
namespace {

using test::movedBy;
using test::randomVolume;
using test::volumeOf;

constexpr double kSumTolerance = 1e-11;
constexpr Box kBox{{-13, -16, -3}, {9, 5, 17}};  // cuts bricks and extends beyond them
constexpr Box kEverywhere{{-32, -32, -32}, {31, 31, 31}};

struct RandomCase {
  std::uint64_t seed;
  float backgroundA, backgroundB;
};

class AgainstDense : public testing::TestWithParam<RandomCase> {};

TEST_P(AgainstDense, theRelativeErrorAgreesWithThePlainLoops) {
  const RandomCase c = GetParam();
  const auto a = randomVolume({.seed = c.seed, .background = c.backgroundA});
  const auto b = randomVolume({.seed = c.seed + 100, .brickRange = 3, .background = c.backgroundB});
  for (const std::optional<double> floor : {std::optional<double>{}, {0.3}}) {
    const double least = floor.value_or(leastMagnitude(a));
    double largest = 0.0;
    for (const SparseVolume* in : {&a, &b})  // the bricks of either
      for (std::size_t brick = 0; brick < in->brickCount(); ++brick)
        for (int v = 0; v < kBrickVoxels; ++v) {
          const Coord at = in->brickCorner(brick) + voxelLocal(v);
          const double value = double(valueAt(a, at));
          const double error = std::abs(double(valueAt(b, at)) - value);
          largest = std::max(largest, error / std::max(std::abs(value), least));
        }
    const RelativeError found = largestRelativeError(a, b, floor);
    EXPECT_DOUBLE_EQ(found.share, largest);
    const double value = double(valueAt(a, found.at));
    EXPECT_DOUBLE_EQ(std::abs(double(valueAt(b, found.at)) - value),
                     largest * std::max(std::abs(value), least));
  }
  EXPECT_EQ(largestRelativeError(a, a, {}).share, 0.0);
}

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
  const auto distance = [](Coord at) { return float(std::hypot(at.x, at.y, at.z)) - 26.0f; };
  const auto isActive = [&](Coord at) { return std::abs(distance(at)) < band; };
  const auto value = [&](Coord at) {
    return isActive(at) ? distance(at) : std::copysign(kBackground, distance(at));
  };
  return test::bricksAt(test::cornersOfCube(8, {-32, -32, -32}), kBackground, value, isActive);
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
  const auto a = randomVolume({.seed = 11, .brickRange = 4, .brickShare = 0.6});
  const auto b = randomVolume({.seed = 12, .brickRange = 4, .brickShare = 0.6});
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

TEST(CompareVolumes, leavesAnInfiniteValueOfBothOutOfTheErrorsAndThePeak) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}, {{1, 0, 0}, std::numeric_limits<float>::infinity()}});
  const auto b = volumeOf({{{0, 0, 0}, 0.5f}, {{1, 0, 0}, std::numeric_limits<float>::infinity()}});
  const VolumeMetrics m = compareVolumes(a, b);
  EXPECT_EQ(m.nonFinite, 1u);
  EXPECT_EQ(m.peak, 1.0);
  EXPECT_EQ(m.boxVoxels, 1.0);
  EXPECT_EQ(m.mseBox, 0.25);
  EXPECT_EQ(m.mseActive, 0.25);
  EXPECT_EQ(m.maxError, 0.5);
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
  EXPECT_THAT([&] { (void)compareVolumes(a, b); }, test::ThrowsSaying<BadInput>("(-9, 2, 3)"));
}

TEST(Psnr, isInfiniteWithoutError) {
  EXPECT_EQ(psnr(0.0, 1.0), std::numeric_limits<double>::infinity());
}

TEST(Psnr, followsItsFormula) {
  EXPECT_DOUBLE_EQ(psnr(1e-4, 1.0), 40.0);
  EXPECT_DOUBLE_EQ(psnr(1e-60, 1e-30), 0.0);
  EXPECT_NEAR(psnr(0.01, 255.0), 20.0 * std::log10(2550.0), 1e-12);
}

// Known answers. Float64 sums of 32^3 values below 1 are precise to 1e-10.

constexpr int kSide = 32, kFirst = 10, kLast = 21;
constexpr double kTolerance = 1e-10;

/// The same function as in make_metrics_fixture.py.
double hashed(std::uint64_t index) {
  return double((index * 2654435761u % (std::uint64_t{1} << 32)) >> 8) / (1 << 24);
}

/// A block of values. Those above `activeAbove` are active.
template <class ValueAt>
SparseVolume block(float background, double activeAbove, const ValueAt& valueAt) {
  const Box box{{kFirst, kFirst, kFirst}, {kLast, kLast, kLast}};
  SparseVolume volume = test::volumeOf(
      box,
      [&](Coord v) { return float(valueAt(std::uint64_t((v.x * kSide + v.y) * kSide + v.z))); },
      background);
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    BrickMask mask;
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i) && double(volume.brickValues(b)[i]) > activeAbove) mask.set(i);
    volume.active[b] = mask;
  }
  return volume;
}

struct Known {
  float background;
  double massReference, massCandidate;
};

class KnownAnswers : public testing::TestWithParam<Known> {};

TEST_P(KnownAnswers, agreeWithScikitImage) {
  const Known& known = GetParam();
  const auto reference = block(known.background, 1.0 / 3.0, hashed);
  const auto candidate = block(known.background, 0.35, [](std::uint64_t i) {
    return 0.75 * hashed(i) + 0.25 * hashed(i + 1000003);
  });
  const auto m = compareVolumes(reference, candidate,
                                {.box = Box{{0, 0, 0}, {kSide - 1, kSide - 1, kSide - 1}},
                                 .peak = 0.9986540079116821});  // the largest value
  EXPECT_NEAR(m.psnrBox, 33.55627761263352, kTolerance);
  EXPECT_NEAR(m.psnrActive, 27.994649501576674, kTolerance);
  EXPECT_EQ(m.maxError, 0.2102183699607849);
  EXPECT_EQ(m.p999Error, 0.2102183699607849);
  EXPECT_NEAR(m.iou, 0.8934010152284264, kTolerance);
  EXPECT_NEAR(m.massReference, known.massReference, kTolerance);
  EXPECT_NEAR(m.massCandidate, known.massCandidate, kTolerance);
}

INSTANTIATE_TEST_SUITE_P(All, KnownAnswers,
                         testing::Values(Known{0.0f, 863.3728325366974, 863.1301729679108},
                                         Known{0.25f, 431.3728325366974, 431.13017296791077}));

// Vectors. All PSNR have the peak of the longest vector. A voxel that is active in one component counts
// in all.

/// A brick whose voxels all have this value.
SparseVolume constant(float value) {
  return test::fullBricks({Coord{}}, 0.0f, [&](Coord) { return value; });
}

VectorVolume constants(float x, float y, float z) {
  return {constant(x), constant(y), constant(z)};
}

TEST(CompareVectors, MeasuresLengthsAndComponentsWithOnePeak) {
  const VectorMetrics m = compareVectors(constants(3, -4, 0), constants(3, -4.5, 0));
  EXPECT_DOUBLE_EQ(m.magnitude.peak, 5.0);
  EXPECT_DOUBLE_EQ(m.components[1].peak, 5.0);
  EXPECT_TRUE(std::isinf(m.components[0].psnrBox));
  EXPECT_NEAR(m.components[1].psnrBox, 20.0, 1e-9);  // 0.5 of 5; float64 rounding
  const double error = std::sqrt(9.0 + 4.5 * 4.5) - 5.0;
  // The lengths are rounded to float32, whose steps are 5e-7 at 5.
  EXPECT_NEAR(m.magnitude.maxError, error, 1e-6);
}

TEST(CompareVectors, CountsVoxelsThatAreActiveInOneComponent) {
  VectorVolume reference = constants(1, 0, 0), candidate = reference;
  candidate[1] = candidate[2] = SparseVolume{};
  const VectorMetrics m = compareVectors(reference, candidate);
  EXPECT_EQ(m.components[1].iou, 1.0);
  EXPECT_TRUE(std::isinf(m.magnitude.psnrBox));
}

/// One voxel of a volume has lost 0.25.
TEST(CompareVectors, AddWhatFloatsLoseOfDoubles) {
  const SparseVolume floats = constant(4.0f);
  Narrowing lost;
  lost.add(4.25, 4.0f, {});
  const double voxels = double(activeVoxelCount(floats));
  const VolumeMetrics exact = compareVolumes(floats, floats, {.narrowing = lost});
  EXPECT_EQ(exact.maxError, 0.25);
  EXPECT_DOUBLE_EQ(exact.mseActive, 0.0625 / voxels);
  EXPECT_DOUBLE_EQ(exact.psnrActive, psnr(0.0625 / voxels, 4.0));
  EXPECT_EQ(compareVolumes(floats, constant(4.5f), {.narrowing = lost}).maxError, 0.75);
  const VectorMetrics vectors = compareVectors({floats, floats, floats}, {floats, floats, floats},
                                               {}, {Narrowing{}, lost, lost});
  EXPECT_EQ(vectors.components[0].maxError, 0.0);
  EXPECT_EQ(vectors.components[1].maxError, 0.25);
  EXPECT_DOUBLE_EQ(vectors.magnitude.maxError, std::sqrt(2.0) * 0.25);
}

TEST(CompareVectors, TakesAGivenPeak) {
  const VectorMetrics m = compareVectors(constants(0, 0, 0), constants(0, 0, 1), {.peak = 10.0});
  EXPECT_NEAR(m.components[2].psnrActive, 20.0, 1e-9);  // float64 rounding
}

TEST(CompareVectors, HaveAPeakThatIsPositive) {
  EXPECT_DOUBLE_EQ(peakOfVectors(constants(-3, 0, 4)), 5.0);
  EXPECT_DOUBLE_EQ(peakOfVectors(constants(0, 0, 0)), 1.0);
}

TEST(CompareVectors, HaveAPeakThatDoesNotFallWithTheRangeOfTheirLengths) {
  VectorVolume vectors = constants(3, 4, 0);
  vectors[1].values[0] = 3.9f;
  EXPECT_DOUBLE_EQ(peakOfVectors(vectors), 5.0);
}

TEST(CompareVectors, HaveOneRangeWhichIsTheLargestOfAComponent) {
  VectorVolume vectors = constants(3, 4, 0);
  vectors[1].values[0] = -1.0f;
  vectors[2].values[0] = 2.0f;
  EXPECT_DOUBLE_EQ(valueRangeOfVectors(vectors), 5.0);
  EXPECT_DOUBLE_EQ(valueRangeOfVectors(constants(1, 1, 1)), 0.0);
}

// Temporal differences. Errors that both frames share must not count; errors that change must.

// All values are multiples of 1/8 below 16, so that sums are exact; the rest is rounding of
// logarithms in float64.
constexpr double kRounding = 1e-9;

const Box kCube{{-3, 2, 5}, {12, 9, 14}};

SparseVolume filled(float value, const Box& box = kCube) {
  return volumeOf(box, [&](Coord) { return value; });
}

TEST(TemporalPsnr, IsInfiniteWhereBothFramesHaveTheSameError) {
  const SparseVolume before = filled(2), after = filled(4);
  const SparseVolume worse = filled(2.5), worseAfter = filled(4.5);
  EXPECT_TRUE(std::isinf(temporalPsnr({before, after}, {before, after})));
  EXPECT_TRUE(std::isinf(temporalPsnr({before, after}, {worse, worseAfter})));
}

TEST(TemporalPsnr, HasTheErrorOfTheChange) {
  const SparseVolume before = filled(2), after = filled(4);
  const SparseVolume low = filled(1.75), high = filled(4.25);
  // The change has an error of 0.5 everywhere, and the peak is 4.
  EXPECT_NEAR(temporalPsnr({before, after}, {low, high}), 20 * std::log10(4 / 0.5), kRounding);
  EXPECT_NEAR(temporalPsnr({before, after}, {low, high}, {.peak = 8.0}), 20 * std::log10(8 / 0.5),
              kRounding);
}

TEST(TemporalPsnr, IsMeasuredOverTheVoxelsOfBothFrames) {
  // The reference moves from one cube to another of the same size; the candidate is not in the
  // second frame, so that half of the box has an error of 4.
  const SparseVolume before = filled(4), after = filled(4, {{13, 2, 5}, {28, 9, 14}});
  const SparseVolume gone{};
  EXPECT_NEAR(temporalPsnr({before, after}, {before, gone}), 10 * std::log10(2.0), kRounding);
}

TEST(TemporalPsnr, TakesAnEmptyFrame) {
  const SparseVolume empty{}, full = filled(4), half = filled(2);
  EXPECT_NEAR(temporalPsnr({empty, full}, {empty, half}), 20 * std::log10(2.0), kRounding);
  EXPECT_NEAR(temporalPsnr({full, empty}, {half, empty}), 20 * std::log10(2.0), kRounding);
  EXPECT_THROW((void)temporalPsnr({empty, empty}, {full, full}), BadInput);
}

TEST(TemporalDifference, IsTheSameVoxelByVoxel) {
  const SparseVolume before = test::randomVolume({.seed = 1, .background = 0.5f});
  const SparseVolume after = test::randomVolume({.seed = 2, .background = 0.25f});
  const SparseVolume change = temporalDifference({before, after});
  checkInvariants(change);
  EXPECT_EQ(change.background, -0.25f);
  for (int x = -20; x < 20; ++x)
    for (int y = -20; y < 20; ++y)
      for (int z = -20; z < 20; ++z) {
        const Coord at{x, y, z};
        // The difference of two float32 numbers in float64 is rounded once.
        ASSERT_EQ(valueAt(change, at), float(double(valueAt(after, at)) - valueAt(before, at)));
      }
}

// Signs. Each voxel whose sign is changed is counted, active or not, and 0 counts as outside. A brick that
// only one volume has is compared with the sign of the empty space of the other one.

TEST(CompareSigns, CountsEveryVoxelOnTheWrongSide) {
  const SparseVolume band = test::levelSetVolume();
  SparseVolume other = band;
  EXPECT_EQ(compareSigns(band, other).voxels, 0u);
  EXPECT_FALSE(compareSigns(band, other).first);
  std::size_t flipped = 0;
  for (std::size_t i = 0; i < other.values.size(); i += 1001, ++flipped)
    other.values[i] = band.values[i] < 0.0f ? 0.0f : -0.5f;
  const SignErrors errors = compareSigns(band, other);
  EXPECT_EQ(errors.voxels, flipped);
  EXPECT_EQ(errors.first, band.brickCorner(0));
}

TEST(CompareSigns, IgnoresTheMagnitude) {
  const SparseVolume band = test::levelSetVolume();
  SparseVolume other = band;
  for (float& v : other.values) v = v < 0.0f ? -1e-30f : 0.0f;
  EXPECT_EQ(compareSigns(band, other).voxels, 0u);
}

TEST(CompareSigns, KnowsTheSideOfEmptySpace) {
  const SparseVolume band = test::levelSetVolume();
  const auto with = [&](Coord place, float value) {
    std::vector<BrickInput> bricks = test::bricksOf(band);
    BrickInput& more = bricks.emplace_back(BrickInput{place * kBrickSide, {}, {}});
    more.values.fill(value);
    more.active.setAll();
    return makeVolume(std::move(bricks), band.background);
  };
  const Coord inside{2, 2, 2}, outside{-1, 2, 2};
  for (const auto& [brick, value, errors] :
       {std::tuple{inside, -1.0f, 0u}, std::tuple{inside, 1.0f, 512u},
        std::tuple{outside, 1.0f, 0u}, std::tuple{outside, -1.0f, 512u}}) {
    const SparseVolume more = with(brick, value);
    ASSERT_EQ(more.brickCount(), band.brickCount() + 1);
    EXPECT_EQ(compareSigns(band, more).voxels, errors);
    EXPECT_EQ(compareSigns(more, band).voxels, errors);
  }
}

}  // namespace
}  // namespace esvr
