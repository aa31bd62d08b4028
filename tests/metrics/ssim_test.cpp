// Plan: SSIM agrees with (1) plain dense float64 windows that are clipped at the box, on random
// sparse volumes; (2) values of scikit-image (make_metrics_fixture.py); (3) closed forms for windows
// that contain background only. The window itself is tested in tests/field/brick_kernels_test.cpp.
//
// Tolerance of (1): a variance has an error of a few eps of the squared values, which are of order
// 1, and is divided by C2 = 9e-4 peak^2. Each SSIM has an error of about 10 * 2.2e-16 / 9e-4 =
// 2.5e-12.
//
// The selection by digits agrees with sorting for errors of all magnitudes, and ranks with
// counting.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "esvr/error.h"
#include "esvr/metrics.h"
#include "metrics/brick_pairs.h"
#include "metrics/volumes.h"

namespace esvr {
namespace {

using test::randomVolume;
using test::volumeOf;

constexpr double kWindowTolerance = 1e-11;

struct DenseCase {
  std::uint64_t seed;
  float backgroundA, backgroundB;
  Box box;
};

class AgainstDenseWindows : public testing::TestWithParam<DenseCase> {};

TEST_P(AgainstDenseWindows, SlowSparseSsimIsTheMeanOfAllWindows) {
  const DenseCase c = GetParam();
  const auto a = randomVolume({.seed = c.seed, .background = c.backgroundA});
  const auto b = randomVolume({.seed = c.seed + 50, .background = c.backgroundB});
  EXPECT_NEAR(ssim3d(a, b, c.box, 1.5), test::denseSsim(a, b, c.box, 1.5), kWindowTolerance);
}

INSTANTIATE_TEST_SUITE_P(Random, AgainstDenseWindows,
                         testing::Values(DenseCase{1, 0.0f, 0.0f, {{-12, -9, -11}, {7, 10, 3}}},
                                         DenseCase{2, 0.5f, 0.5f, {{-12, -9, -11}, {7, 10, 3}}},
                                         DenseCase{3, 0.0f, 0.25f, {{-20, -20, -4}, {-1, 1, 5}}},
                                         // narrower than the window, and a single voxel
                                         DenseCase{4, 0.0f, 0.0f, {{-14, -3, 1}, {14, 0, 2}}},
                                         DenseCase{5, 0.0f, 0.0f, {{-4, -4, -4}, {-4, -4, -4}}}));

/// The block of hashed values of make_metrics_fixture.py.
float fixtureValue(Coord v, std::uint64_t shift) {
  const auto index = std::uint64_t((v.x * 32 + v.y) * 32 + v.z) + shift;
  return float(std::uint32_t(index * 2654435761u) >> 8) * 0x1p-24f;
}

struct FixtureCase {
  float backgroundA, backgroundB;
  double peak, ssim;
};

class AgainstScikitImage : public testing::TestWithParam<FixtureCase> {};

TEST_P(AgainstScikitImage, boxMeanAgrees) {
  const FixtureCase c = GetParam();
  const Box block{{10, 10, 10}, {21, 21, 21}};
  const auto a = volumeOf(
      block, [](Coord v) { return fixtureValue(v, 0); }, c.backgroundA);
  const auto mixed = [](Coord v) {
    return float(0.75 * fixtureValue(v, 0) + 0.25 * fixtureValue(v, 1000003));
  };
  const auto b = volumeOf(block, mixed, c.backgroundB);
  const double got = ssim3d(a, b, Box{{0, 0, 0}, {31, 31, 31}}, c.peak);
  EXPECT_NEAR(got, c.ssim, 1e-10);  // scikit-image subtracts moments of order 1 too
}

INSTANTIATE_TEST_SUITE_P(Fixture, AgainstScikitImage,
                         testing::Values(FixtureCase{0.0f, 0.0f, 1.0, 0.9958420323404611},
                                         FixtureCase{0.0f, 0.0f, 4.0, 0.9969819328965087},
                                         FixtureCase{0.25f, 0.25f, 1.0, 0.9927726271701163},
                                         FixtureCase{0.25f, 0.25f, 4.0, 0.9954547156279874},
                                         FixtureCase{0.0f, 0.125f, 1.0, 0.10972615086068897},
                                         FixtureCase{0.0f, 0.125f, 4.0, 0.1860523860886215}));

TEST(Ssim3d, emptySpaceOfOneBackgroundCountsAsExactlyOne) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}}, 0.1f);
  const auto b = volumeOf({{{0, 0, 0}, 0.2f}}, 0.1f);
  EXPECT_EQ(ssim3d(a, b, Box{{100, 100, 100}, {120, 120, 120}}, 1.0), 1.0);
}

TEST(Ssim3d, emptySpaceOfTwoBackgroundsFollowsTheLuminanceTerm) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}}, 0.5f);
  const auto b = volumeOf({{{0, 0, 0}, 1.0f}}, 0.25f);
  const double c1 = 1e-4;
  const double want = (2 * 0.5 * 0.25 + c1) / (0.25 + 0.0625 + c1);
  EXPECT_DOUBLE_EQ(ssim3d(a, b, Box{{100, 100, 100}, {120, 120, 120}}, 1.0), want);
}

TEST(Ssim3d, voxelsOutsideTheBoxAreNotSeen) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}});
  const SparseVolume none;
  EXPECT_EQ(ssim3d(a, none, Box{{0, 0, 1}, {0, 0, 5}}, 1.0), 1.0);
  EXPECT_LT(ssim3d(a, none, Box{{0, 0, 0}, {0, 0, 5}}, 1.0), 1.0);
}

TEST(Ssim3d, ofTwoVolumesIsSymmetric) {
  const auto a = randomVolume({.seed = 31}), b = randomVolume({.seed = 32, .background = 0.5f});
  const Box box{{-9, -9, -9}, {9, 9, 9}};
  EXPECT_NEAR(ssim3d(a, b, box, 1.0), ssim3d(b, a, box, 1.0), 1e-15);
}

TEST(Ssim3d, refusesValuesThatAreNotFinite) {
  const auto a = volumeOf({{{0, 0, 0}, NAN}}), b = volumeOf({{{0, 0, 0}, 1.0f}});
  EXPECT_THROW((void)ssim3d(a, b, Box{{0, 0, 0}, {1, 1, 1}}, 1.0), BadInput);
}

TEST(Ssim3d, refusesAnEmptyBoxAndAPeakThatIsNotPositive) {
  const auto a = volumeOf({{{0, 0, 0}, 1.0f}});
  EXPECT_THROW((void)ssim3d(a, a, Box{}, 1.0), UsageError);
  EXPECT_THROW((void)ssim3d(a, a, Box{{0, 0, 0}, {1, 1, 1}}, 0.0), UsageError);
}

}  // namespace
}  // namespace esvr

// ---- Pairs of bricks

namespace esvr::metrics {
namespace {

/// A row of voxels whose errors against an empty candidate are given.
SparseVolume rowOf(const std::vector<float>& errors) {
  std::vector<test::Voxel> voxels;
  for (std::size_t i = 0; i < errors.size(); ++i)
    voxels.push_back({{int(i) * 3 - 40, 1, -1}, errors[i]});
  return test::volumeOf(voxels);
}

TEST(ErrorOfRank, isTheSortedErrorOfThatRank) {
  std::vector<float> errors;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const double magnitude = std::pow(10.0, 60.0 * test::hashUnit(1, i) - 30.0);
    errors.push_back(float(i % 2 ? magnitude : -magnitude));
  }
  errors.insert(errors.end(), {0.0f, 0.0f, 1.0f, 1.0f, -1.0f});
  const SparseVolume reference = rowOf(errors), none;
  const auto pairs = pairBricks(reference, none);
  for (float& e : errors) e = std::abs(e);
  std::sort(errors.begin(), errors.end());
  for (std::size_t rank = 1; rank <= errors.size(); rank += rank < 8 ? 1 : 13)
    ASSERT_EQ(errorOfRank(pairs, rank), errors[rank - 1]) << "rank " << rank;
}

TEST(ErrorOfRank, findsOneOfManyThatBeginWithTheSameBits) {
  SparseVolume reference = test::volumeOf({{{0, 0, 0}, 1.0f}});
  constexpr std::size_t kBricks = 700;  // of 512 voxels: more than are sorted at once
  reference.bricks.clear();
  for (std::size_t b = 0; b < kBricks; ++b) reference.bricks.push_back({0, 0, int(b)});
  reference.values.resize(kBricks * kBrickVoxels);
  reference.active.assign(kBricks, BrickMask{});
  for (BrickMask& mask : reference.active)
    for (int v = 0; v < kBrickVoxels; ++v) mask.set(v);
  for (std::size_t i = 0; i < reference.values.size(); ++i)
    reference.values[i] = 1.0f + 0x1p-23f * float(i * 7919 % reference.values.size());
  const SparseVolume none;
  const auto pairs = pairBricks(reference, none);
  for (const std::size_t rank :
       {std::size_t{1}, reference.values.size() / 3, reference.values.size()})
    EXPECT_EQ(errorOfRank(pairs, rank), 1.0 + 0x1p-23 * double(rank - 1)) << rank;
}

TEST(ErrorOfRank, countsEachVoxelOfTheUnionOnce) {
  const auto a = test::volumeOf({{{0, 0, 0}, 1.0f}, {{1, 0, 0}, 2.0f}});
  const auto b = test::volumeOf({{{1, 0, 0}, 5.0f}, {{9, 0, 0}, 7.0f}});
  const auto pairs = pairBricks(a, b);
  EXPECT_EQ(errorOfRank(pairs, 1), 1.0);
  EXPECT_EQ(errorOfRank(pairs, 2), 3.0);
  EXPECT_EQ(errorOfRank(pairs, 3), 7.0);
}

TEST(NearestRank, isTheCeilingOfTheShare) {
  EXPECT_EQ(nearestRank(1, 999), 1u);
  EXPECT_EQ(nearestRank(999, 999), 999u);  // the ceiling of 998.001
  EXPECT_EQ(nearestRank(1000, 999), 999u);
  EXPECT_EQ(nearestRank(1001, 999), 1000u);
  EXPECT_EQ(nearestRank(2000, 999), 1998u);
  EXPECT_EQ(nearestRank(std::uint64_t{1} << 60, 1000), std::uint64_t{1} << 60);
}

TEST(P999, isTheNineHundredNinetyNinthOfAThousandErrors) {
  std::vector<float> errors;
  for (int i = 0; i < 1000; ++i) errors.push_back(float((i * 7919) % 1000 + 1));  // a permutation
  const auto m = compareVolumes(rowOf(errors), SparseVolume{});
  EXPECT_EQ(m.p999Error, 999.0);
  EXPECT_EQ(m.maxError, 1000.0);
}

}  // namespace
}  // namespace esvr::metrics
