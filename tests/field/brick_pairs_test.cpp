// Plan: the pairs over the bricks of an index are those found by testing every brick against every
// support, in the order of the bricks' coordinates, for supports that are smaller and larger than
// the index. More pairs than 32 bits can number are refused.
// One walk that also finds the bricks of the index gives the same lists.
// forEachReachedBrick visits the bricks that a test of every brick of the bounding box finds,
// in the same order, for balls, thin and flat ellipsoids of all directions. Supports with NaN have
// no bricks, supports beyond the index space are cut off, and upper bounds of counts hold.
//
// Estimates are upper bounds of what the lists of an evaluation hold. They are refined if they seem too large, and take no
// time for supports of any size. Work that is too large is refused before it begins.
//
// A coarser voxel is compared with the mean, in float64, of the voxels in its space. A wider
// ellipsoid has the moments of that mean up to the second. For a Gaussian of standard deviation sigma,
// what is left is (side / sigma)^4 / 320 of its height, as the fourth cumulant of a box along each of
// three axes is -side^4 / 120, and the fourth derivative of a Gaussian is at most 3 / sigma^4; and the
// kernel is cut off at epsilon, 0.6 % of its height. The tolerance is twice the sum of both. A kernel with
// edges changes its shape under a filter, which an ellipsoid cannot follow, but its error has to be less
// than half of that of a sample at the middle of the space.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "field/brick_pairs.h"
#include "field/coarser_field.h"
#include "field/evaluate.h"
#include "field/random_field.h"
#include "field/support.h"
#include "field/voxel_rule.h"
#include "support/messages.h"

namespace esvr {
namespace {

// Pairs.

constexpr Box kAll = bricksOf(Box::whole());

std::vector<Coord> walked(const Support& support, const Box& within = kAll) {
  std::vector<Coord> bricks;
  forEachReachedBrick(support, within, [&](Coord brick) { bricks.push_back(brick); });
  return bricks;
}

std::vector<Coord> lookedUp(const Support& support, const Box& within = kAll) {
  std::vector<Coord> bricks;
  brick_walk::visitBox(SlabTest(support), common(brickRange(support), within),
                       [&](Coord brick) { bricks.push_back(brick); });
  return bricks;
}

Field fieldOf(double smallest, double aspect) {
  return test::randomField({.count = 30, .extent = 100.0, .smallest = smallest, .aspect = aspect});
}

TEST(BrickWalk, FindsTheBricksOfTheWholeBox) {
  for (const auto& [smallest, aspect] :
       {std::pair{0.2, 1.0}, {20.0, 1.0}, {40.0, 3.0}, {0.3, 300.0}, {0.01, 1e4}})
    for (const Support& support : supports(fieldOf(smallest, aspect)))
      EXPECT_EQ(walked(support), lookedUp(support)) << smallest << " " << aspect;
}

TEST(BrickWalk, FindsTheBricksOfAPart) {
  const Box part{{-3, 2, -20}, {9, 11, 30}};
  for (const Support& support : supports(fieldOf(5.0, 20.0)))
    EXPECT_EQ(walked(support, part), lookedUp(support, part));
}

TEST(BrickWalk, CountsAreBounded) {
  for (const auto& [smallest, aspect] : {std::pair{0.2, 1.0}, {20.0, 1.0}, {0.3, 300.0}}) {
    const auto reach = supports(fieldOf(smallest, aspect));
    for (const Support& support : reach)
      EXPECT_GE(maxBricks(support, kAll), double(walked(support).size()));
  }
}

TEST(BrickWalk, ABoundOnTheBricksOfALargeSupportIsClose) {
  for (const Support& support : supports(fieldOf(50.0, 1.5)))
    EXPECT_LE(maxBricks(support, kAll), 1.5 * double(walked(support).size()));
}

TEST(BrickWalk, CountsBricksThatSeveralSupportsReachOnce) {
  const Field field = fieldOf(10.0, 2.0);
  const auto reach = supports(field);
  const double counted = countBricks(reach, kAll, std::numeric_limits<double>::infinity());
  EXPECT_EQ(counted, double(reachedBricks(field).size()));
  const double stopped = countBricks(reach, kAll, counted / 2.0);
  EXPECT_GT(stopped, counted / 2.0);
  EXPECT_LE(stopped, counted);
}

Support ballOf(double center, double logScale) {
  const double inverse = std::exp(-logScale);
  return makeSupport({center, center, center}, {inverse, 0, 0, 0, inverse, 0, 0, 0, inverse}, 2.0,
                     0.02);
}

TEST(BrickWalk, ASupportBeyondTheIndexSpaceIsCutOffAtItsEnds) {
  for (const double logScale : {25.0, 32.0, 60.0})
    EXPECT_EQ(brickRange(ballOf(1000.0, logScale)), kAll) << logScale;
  const Box far = brickRange(ballOf(1e30, 3.0));
  EXPECT_EQ(far.min, kAll.max);
  EXPECT_TRUE(walked(ballOf(1e30, 3.0)).empty());
}

TEST(BrickWalk, ASupportWithoutNumbersHasNoBricks) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Support& support : {ballOf(nan, 1.0), ballOf(0.0, nan), ballOf(0.0, 1000.0)})
    EXPECT_TRUE(brickRange(support).empty());
}

// The bounding box of a diagonal thin ellipsoid has 10^12 bricks, of which it reaches about 10^5.
TEST(BrickWalk, ANeedleCostsWhatItReaches) {
  const double s = 1.0 / std::sqrt(3.0), t = 1.0 / std::sqrt(2.0), u = 1.0 / std::sqrt(6.0);
  const double across = 1.0, along = 1.0 / 35000.0;
  const Matrix3 L{along * s, along * s,  along * s,  across * t,       -across * t,
                  0.0,       across * u, across * u, -2.0 * across * u};
  const auto bricks = walked(makeSupport({0.0, 0.0, 0.0}, L, 2.0, 0.02));
  EXPECT_GT(bricks.size(), 10000u);
  EXPECT_LT(bricks.size(), 1000000u);
}

// Pairs.

/// Bricks far apart, in random order.
std::vector<Coord> scatteredBricks(std::size_t count) {
  test::Random random(3);
  std::vector<Coord> bricks;
  const auto any = [&] { return std::int32_t(random(-300.0, 300.0)); };
  while (bricks.size() < count) {
    const Coord brick{any(), any(), any()};
    if (std::find(bricks.begin(), bricks.end(), brick) == bricks.end()) bricks.push_back(brick);
  }
  return bricks;
}

void expectAllPairs(const std::vector<Coord>& bricks, const std::vector<Support>& reach) {
  const BrickPairs pairs = pairsWithin(BrickIndex(bricks), reach.size(),
                                       [&](std::size_t i) -> const Support& { return reach[i]; });
  for (std::size_t i = 0; i < reach.size(); ++i) {
    std::vector<Coord> expected, found;
    const Box range = brickRange(reach[i]);
    for (const Coord brick : bricks)
      if (range.contains(brick) && SlabTest(reach[i])(brick)) expected.push_back(brick);
    std::sort(expected.begin(), expected.end());
    for (auto k = pairs.ellipsoidBegin[i]; k != pairs.ellipsoidBegin[i + 1]; ++k) {
      const auto brick =
          std::upper_bound(pairs.brickBegin.begin(), pairs.brickBegin.end(), pairs.pairOf[k]) -
          pairs.brickBegin.begin() - 1;
      found.push_back(bricks[std::size_t(brick)]);
    }
    EXPECT_EQ(found, expected) << i;
  }
}

TEST(BrickPairs, AreThoseOfEveryBrickWithEverySupport) {
  const auto bricks = scatteredBricks(400);
  for (const double smallest : {2.0, 300.0, 1e6})
    expectAllPairs(bricks, supports(test::randomField(
                               {.count = 20, .extent = 500.0, .smallest = smallest, .aspect = 5})));
}

// One walk appends the bricks that an index misses, in increasing order, and lists all pairs.
TEST(BrickPairs, OfAllBricksAreThoseOfAnIndexThatHasThem) {
  const auto reach =
      supports(test::randomField({.count = 300, .extent = 60.0, .smallest = 1.0, .aspect = 10}));
  const SupportOf supportOf = [&](std::size_t i) -> const Support& { return reach[i]; };
  const std::vector<Coord> some{{3, 2, 1}, {0, 0, 0}, {90, 0, 0}, {2, 2, 2}};
  for (const auto& known : {some, std::vector<Coord>{}})
    for (const Box& within : {kAll, Box{{1, 1, 1}, {5, 4, 6}}}) {
      BrickIndex expectedIndex(known), index(known);
      expectedIndex.append(missingBricks(expectedIndex, reach.size(), supportOf, within));
      const BrickPairs expected = pairsWithin(expectedIndex, reach.size(), supportOf);
      const BrickPairs pairs = pairsOfAll(index, reach.size(), supportOf, within);
      EXPECT_EQ(index.bricks(), expectedIndex.bricks());
      EXPECT_EQ(pairs.brickBegin, expected.brickBegin);
      EXPECT_EQ(pairs.ellipsoid, expected.ellipsoid);
      EXPECT_EQ(pairs.ellipsoidBegin, expected.ellipsoidBegin);
      EXPECT_EQ(pairs.pairOf, expected.pairOf);
    }
}

TEST(BrickPairs, OffsetsBeyond32BitsAreRefusedByTheirNumber) {
  std::vector<std::uint32_t> few{3, 0, 2, 0};
  makeOffsets(few);
  EXPECT_EQ(few, (std::vector<std::uint32_t>{0, 3, 3, 5}));
  std::vector<std::uint32_t> many(4, 0x7fffffffu);
  many.back() = 0;
  EXPECT_THAT([&] { makeOffsets(many); }, test::ThrowsSaying<RuntimeFailure>("6442450941"));
}

// Estimates of the work.

Field ballOf(float logScale, float center = 0.0f) {
  Field field;
  field.chunks.resize(1);
  Ellipsoids& e = field.chunks[0].ellipsoids;
  e.resize(1);
  for (auto& c : e.center) c[0] = center;
  for (auto& s : e.logScale) s[0] = logScale;
  e.rotation[0][0] = 1.0f;
  e.intensity[0] = 1.0f;
  return field;
}

TEST(WorkEstimate, IsABound) {
  for (const double smallest : {0.3, 4.0}) {
    const Field field = test::randomField({.count = 200, .smallest = smallest, .aspect = 20.0});
    const auto bricks = reachedBricks(field);
    const WorkEstimate estimate = estimateWork(field);
    EXPECT_GE(estimate.bricks, double(bricks.size()));
    EXPECT_GE(estimate.pairs, double(planEvaluation(field, bricks).pairs.pairCount()));
  }
}

TEST(WorkEstimate, CountsBricksOnceWhereItSeemsTooLarge) {
  const Field field = test::randomField({.count = 500, .smallest = 6.0, .aspect = 2.0});
  const double bricks = double(reachedBricks(field).size());
  const WorkEstimate rough = estimateWork(field);
  EXPECT_GT(rough.bricks, bricks);
  EXPECT_EQ(estimateWork(field, {.enough = rough.bytes() - 1.0}).bricks, bricks);
}

TEST(WorkEstimate, CountsOnlyWhatIsWanted) {
  const Field field = ballOf(3.0f);
  const Box part{{0, 0, 0}, {7, 15, 7}};
  EXPECT_LE(estimateWork(field, {.within = part}).bricks, 2.0);
  EXPECT_EQ(reachedBricks(field, part).size(), 2u);
}

TEST(WorkEstimate, OfAnyScaleIsKnownAtOnce) {
  EXPECT_GT(estimateWork(ballOf(6.0f), {.enough = 1e9}).bytes(), 1e9);
  EXPECT_GT(estimateWork(ballOf(32.0f), {.enough = 1e12}).bytes(), 1e24);
}

TEST(WorkEstimate, ListsThatNoMachineHoldsAreNotBegun) {
  EXPECT_THROW((void)reachedBricks(ballOf(20.0f)), MemoryExceeded);
  EXPECT_THROW((void)revoxelise(ballOf(32.0f), {}), MemoryExceeded);
}

TEST(WorkEstimate, AHugeSupportIsEvaluatedOnFewBricksAtOnce) {
  const std::vector<Coord> corners{{-800, 0, 8}, {0, 0, 0}, {80000, 8, 0}};
  std::vector<float> values(corners.size() * kBrickVoxels);
  evaluateBricks(ballOf(30.0f), corners, values);
  EXPECT_FLOAT_EQ(values.front(), 1.0f);
  EXPECT_FLOAT_EQ(values.back(), 1.0f);
}

// The difference of corner and origin has 33 bits.
TEST(WorkEstimate, AnOriginAtTheOtherEndOfTheIndexSpaceIsNoHarm) {
  Field field = ballOf(30.0f);
  field.chunks[0].origin = {Box::kMin, Box::kMin, Box::kMin};
  const std::vector<Coord> corners{{Box::kMax - 7, Box::kMax - 7, Box::kMax - 7}};
  std::vector<float> values(kBrickVoxels);
  evaluateBricks(field, corners, values);
  EXPECT_NEAR(values[0], 1.0f, 1e-3f);
}

TEST(WorkEstimate, BricksTooFarApartForAVolumeAreRefused) {
  Field field = ballOf(0.0f, -1.2e9f);
  field.chunks.push_back(ballOf(0.0f, 1.2e9f).chunks[0]);
  EXPECT_THAT([&] { (void)revoxelise(field, {}); }, test::ThrowsSaying<RuntimeFailure>("2^31"));
}

TEST(RequireWithinMemory, NamesBothNumbers) {
  EXPECT_NO_THROW(requireWithinMemory(100.0, 100, "it"));
  EXPECT_THAT([] { requireWithinMemory(28.4e9, 17'000'000'000, "grid 'smoke'"); },
              test::ThrowsSaying<MemoryExceeded>("grid 'smoke'", "28.4 GB", "17 GB"));
}

}  // namespace
}  // namespace esvr

namespace esvr::test {
namespace {

double meanOfSpace(const Field& field, int level, Coord voxel) {
  const int side = 1 << level;
  double sum = 0.0;
  for (int n = 0; n < side * side * side; ++n)
    sum += evaluateReference(field,
                             voxel * side + Coord{n / (side * side), n / side % side, n % side});
  return sum / (double(side) * side * side);
}

/// One ellipsoid of scales 3, 4 and 5 in a turned position, and in a chunk whose origin is no multiple
/// of a coarser voxel.
Field turnedEllipsoid(float kappa) {
  Field field = randomField({.count = 1, .extent = 4.0, .kappa = kappa, .origin = {-8, 24, -40}});
  field.background = 0.5f;
  field.chunks[0].origin.x = -5;
  Ellipsoids& e = field.chunks[0].ellipsoids;
  for (int a = 0; a < 3; ++a) e.logScale[std::size_t(a)][0] = std::log(3.0f + float(a));
  e.intensity[0] = -2.0f;
  return field;
}

/// The voxels of a level around turnedEllipsoid().
template <class Visit>
void forEachAround(int level, const Visit& visit) {
  const int side = 1 << level;
  const Coord middle{-3 / side, 26 / side, -38 / side};
  for (int n = 0; n < 7 * 7 * 7; ++n) visit(middle + Coord{n / 49 - 3, n / 7 % 7 - 3, n % 7 - 3});
}

TEST(CoarserField, HasTheMeansOfGaussians) {
  const Field field = turnedEllipsoid(-6.0f);
  const double sigma = 3.0 * std::sqrt(momentsOf(kernelConstants<double>(field.kernel)).variance);
  for (const int level : {1, 2}) {
    const Field coarser = coarserField(field, level);
    const double tolerance = 2.0 * 2.0 * (std::pow(std::exp2(level) / sigma, 4) / 320.0 + 0.006);
    forEachAround(level, [&](Coord voxel) {
      EXPECT_NEAR(evaluateReference(coarser, voxel), meanOfSpace(field, level, voxel), tolerance)
          << toString(voxel) << " of level " << level;
    });
  }
}

TEST(CoarserField, IsCloserToTheMeansThanSamples) {
  for (const float kappa : {-6.0f, 0.3f, 2.0f, 5.0f})
    for (const int level : {1, 2}) {
      const Field field = turnedEllipsoid(kappa), coarser = coarserField(field, level);
      double ofSums = 0.0, ofSamples = 0.0;
      forEachAround(level, [&](Coord voxel) {
        const double mean = meanOfSpace(field, level, voxel), side = std::exp2(level);
        const auto middle = [&](std::int32_t at) { return at * side + 0.5 * (side - 1.0); };
        const Place place{middle(voxel.x), middle(voxel.y), middle(voxel.z)};
        float sample = 0.0f;
        evaluatePlaces(field, {&place, 1}, {&sample, 1});
        ofSums += std::pow(evaluateReference(coarser, voxel) - mean, 2);
        ofSamples += std::pow(double(sample) - mean, 2);
      });
      EXPECT_LT(std::sqrt(ofSums), 0.5 * std::sqrt(ofSamples)) << kappa << ", level " << level;
    }
}

TEST(CoarserField, KeepsTheIntegralOfSmallEllipsoids) {
  // Whatever the size of an ellipsoid, the sum over all voxels is that over the finer ones, which is
  // its integral: up to 3 %, because voxels sample a kernel that is little wider than they are.
  Field field =
      randomField({.count = 60, .extent = 60.0, .smallest = 0.8, .aspect = 3.0, .kappa = 0.3f});
  for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
  const auto total = [](const Field& f) {
    double sum = 0.0;
    const SparseVolume volume = revoxelise(f, {});
    for (const float v : volume.values) sum += double(v);
    return sum;
  };
  const double fine = total(field);
  for (const int level : {1, 2, 3})
    EXPECT_NEAR(total(coarserField(field, level)) * std::pow(8.0, level), fine, 0.03 * fine)
        << level;
}

TEST(CoarserField, LevelZeroIsTheFieldItself) {
  const Field field = randomField({.count = 20});
  const Field same = coarserField(field, 0);
  for (int n = 0; n < 1000; ++n) {
    const Coord voxel{n / 100 * 4, n / 10 % 10 * 4, n % 10 * 4};
    EXPECT_NEAR(evaluateReference(same, voxel), evaluateReference(field, voxel), 1e-5);
  }
}

TEST(CoarserField, KnowsTheMomentsOfKernels) {
  for (const double kappa : {-20.0, -2.0, 0.3, 4.0, 10.0, 100.0}) {
    const auto k = kernelConstants<double>(Kernel{}, kappa);
    double mass = 0.0, second = 0.0, fourth = 0.0;
    constexpr int kParts = 20'000;
    for (int i = 0; i < kParts; ++i) {
      const double r = (i + 0.5) / kParts * supportRadius(k), rr = r * r;
      const double phi = kernelPhi(k, rr) * rr * supportRadius(k) / kParts;
      mass += phi, second += phi * rr, fourth += phi * rr * rr;
    }
    const PlaceMoments moments = momentsOf(k);
    const double tolerance = kappa > 10.0 ? 0.02 : 1e-4;
    EXPECT_NEAR(moments.mass, mass, tolerance * mass) << kappa;
    EXPECT_NEAR(moments.variance, second / (3.0 * mass), tolerance * moments.variance) << kappa;
    EXPECT_NEAR(moments.kurtosis, 9.0 * fourth * mass / (second * second), 15.0 * tolerance)
        << kappa;
  }
  Kernel gaussian;
  gaussian.epsilon = 1e-7f;
  EXPECT_NEAR(momentsOf(kernelConstants<double>(gaussian, -30.0)).kurtosis, 15.0, 0.01);
  // A solid ball has a mean of r^4 of 3/7 and a variance of 1/5.
  EXPECT_NEAR(momentsOf(kernelConstants<double>(Kernel{}, 1e4)).kurtosis, 75.0 / 7.0, 0.1);
}

TEST(CoarserField, SoftensTheEdgesOfEachEllipsoid) {
  Field field = randomField({.count = 3});
  Ellipsoids& e = field.chunks[0].ellipsoids;
  e.kappa = {5.0f, 20.0f, 20.0f};
  for (auto& scale : e.logScale) scale = {1.0f, 1.0f, 3.0f};
  const Ellipsoids wide = coarserField(field, 2).chunks[0].ellipsoids;
  EXPECT_LT(wide.kappa[0], 4.0f);
  EXPECT_LT(wide.kappa[1], 15.0f);
  EXPECT_GT(wide.kappa[2], wide.kappa[1]) << "the edges of a large ellipsoid stay sharp";
}

TEST(CoarserField, TheSharesOfABoxAddUpToItsVoxels) {
  const Box box{{-5, 3, 0}, {9, 4, 6}};
  for (const int level : {0, 1, 2, 3}) {
    double voxels = 0.0;
    for (int n = 0; n < 32 * 32 * 32; ++n)
      voxels += double(shareWithin(box, level, {n / 1024 - 16, n / 32 % 32 - 16, n % 32 - 16}));
    EXPECT_NEAR(voxels * std::pow(8.0, level), box.volume(), 1e-6) << level;
  }
  EXPECT_EQ(shareWithin(Box::whole(), 5, {-7, 0, 12345}), 1.0f);
  EXPECT_EQ(shareWithin(Box{}, 1, {0, 0, 0}), 0.0f);
}

TEST(CoarserField, ReachesAllThatDiffersInLevelZero) {
  const Field field = randomField({.count = 40, .extent = 80.0, .smallest = 0.2, .aspect = 12.0});
  const SparseVolume volume = revoxelise(field, {});
  for (const int level : {1, 2, 3}) {
    const auto reach = coarserReach(coarserField(field, level), Box::whole());
    ASSERT_TRUE(std::is_sorted(reach.begin(), reach.end()));
    for (std::size_t b = 0; b < volume.brickCount(); ++b)
      for (int v = 0; v < kBrickVoxels; ++v) {
        if (!volume.active[b].test(v)) continue;
        const Coord voxel = volume.brickCorner(b) + voxelLocal(v);
        const Coord coarser{voxel.x >> level, voxel.y >> level, voxel.z >> level};
        EXPECT_TRUE(std::ranges::binary_search(reach, coarser - localOf(coarser)));
      }
  }
}

TEST(CoarserField, OnlyThresholdsWithoutABandHaveCoarserSums) {
  Field field = randomField({.count = 20});
  const ValueRange above{0.0f, 1.0f}, around{-0.1f, 1.0f};
  EXPECT_TRUE(hasCoarserFields(field, {.threshold = 0.1f, .range = above}));
  EXPECT_FALSE(hasCoarserFields(field, {.range = above, .narrowBand = true}));
  EXPECT_FALSE(hasCoarserFields(field, {.range = above, .restrictToBricks = true}));
  EXPECT_FALSE(hasCoarserFields(field, {.range = around}));
  EXPECT_FALSE(hasCoarserFields(field, {})) << "intensities of both signs";
  for (float& i : field.chunks[0].ellipsoids.intensity) i = -std::abs(i);
  EXPECT_TRUE(hasCoarserFields(field, {}));
}

}  // namespace
}  // namespace esvr::test
