// Plan: a coarser voxel is compared with the mean, in float64, of the voxels in its space. A wider
// ellipsoid has the moments of that mean up to the second. For a Gaussian of standard deviation sigma,
// what is left is (side / sigma)^4 / 320 of its height, as the fourth cumulant of a box along each of
// three axes is -side^4 / 120, and the fourth derivative of a Gaussian is at most 3 / sigma^4; and the
// kernel is cut off at epsilon, 0.6 % of its height. The tolerance is twice the sum of both. A kernel with
// edges changes its shape under a filter, which an ellipsoid cannot follow, but its error has to be less
// than half of that of a sample at the middle of the space.
#include "field/coarser_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "field/random_field.h"
#include "field/voxel_rule.h"

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
