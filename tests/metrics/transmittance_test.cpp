// Plan: the PSNR of transmittance is that of the definition, written as loops over all voxels of the
// box, for volumes whose bricks, origins, backgrounds and boxes differ. Bodies of one value have
// closed forms. Equal volumes have no error, whatever their bricks and their active voxels. Extreme
// values make no NaN, and volumes far apart take no dense picture. A change of the reference is
// measured as the changed volume is. Nothing is measured where no light could be told from none.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/metrics.h"
#include "field/random_field.h"
#include "metrics/transmittance.h"
#include "metrics/volumes.h"
#include "support/machine.h"
#include "support/messages.h"

namespace esvr {
namespace {

using test::movedBy;
using test::randomVolume;
using test::volumeOf;
using test::Voxel;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The definition.

/// The depths of all columns of a box along the three axes, one picture after the other.
std::vector<double> depthsOf(const SparseVolume& volume, const Box& box) {
  std::vector<double> depths;
  for (int axis = 0; axis < 3; ++axis) {
    const auto swapped = [&](int along, int a, int b) {
      if (axis == 0) return Coord{along, a, b};
      if (axis == 1) return Coord{a, along, b};
      return Coord{a, b, along};
    };
    const auto sideOf = [&](Coord c, int side) { return side == 0 ? c.x : side == 1 ? c.y : c.z; };
    const int first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
    for (int a = sideOf(box.min, first); a <= sideOf(box.max, first); ++a)
      for (int b = sideOf(box.min, second); b <= sideOf(box.max, second); ++b) {
        double depth = 0.0;
        for (int at = sideOf(box.min, axis); at <= sideOf(box.max, axis); ++at)
          depth += std::max(double(valueAt(volume, swapped(at, a, b))), 0.0);
        depths.push_back(depth);
      }
  }
  return depths;
}

TransmittancePsnr byDefinition(const SparseVolume& reference, const SparseVolume& candidate,
                               const Box& box) {
  const auto a = depthsOf(reference, box), b = depthsOf(candidate, box);
  float largest = 0.0f;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z)
        largest = std::max(largest, valueAt(reference, {x, y, z}));
  std::vector<double> deep;
  for (const double depth : a)
    if (depth > double(largest) / 1000.0) deep.push_back(depth);
  std::sort(deep.begin(), deep.end());
  const double median = deep.at(deep.size() / 2);
  const auto psnrOf = [&](double share) {
    const double k = -std::log(share) / median;
    double squares = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
      squares += std::pow(std::exp(-k * a[i]) - std::exp(-k * b[i]), 2);
    return -10.0 * std::log10(squares / double(a.size()));
  };
  return {median, psnrOf(0.9), psnrOf(0.5), psnrOf(0.1)};
}

void expectNear(const TransmittancePsnr& got, const TransmittancePsnr& want) {
  constexpr double kSumRounding = 1e-9;  // rounding of float64 sums
  EXPECT_NEAR(got.medianDepth / want.medianDepth, 1.0, kSumRounding);
  EXPECT_NEAR(got.psnr90, want.psnr90, kSumRounding);
  EXPECT_NEAR(got.psnr50, want.psnr50, kSumRounding);
  EXPECT_NEAR(got.psnr10, want.psnr10, kSumRounding);
}

void expectExact(const std::optional<TransmittancePsnr>& got) {
  ASSERT_TRUE(got);
  EXPECT_EQ(got->psnr90, kInfinity);
  EXPECT_EQ(got->psnr50, kInfinity);
  EXPECT_EQ(got->psnr10, kInfinity);
}

bool areSame(const TransmittancePsnr& a, const TransmittancePsnr& b) {
  return a.medianDepth == b.medianDepth && a.psnr90 == b.psnr90 && a.psnr50 == b.psnr50 &&
         a.psnr10 == b.psnr10;
}

struct Case {
  float backgroundReference, backgroundCandidate;
  std::optional<Box> box{};
  Coord shift{};  ///< of the candidate
};

class TransmittanceCases : public testing::TestWithParam<Case> {};

TEST_P(TransmittanceCases, AreThoseOfTheDefinition) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const SparseVolume a = randomVolume(
        {.seed = seed, .brickShare = 0.6, .background = GetParam().backgroundReference});
    const SparseVolume b = movedBy(
        randomVolume(
            {.seed = seed + 7, .brickShare = 0.5, .background = GetParam().backgroundCandidate}),
        GetParam().shift);
    const auto got = transmittancePsnr(a, b, GetParam().box);
    ASSERT_TRUE(got);
    expectNear(*got, byDefinition(a, b, GetParam().box.value_or(activeBox(a))));
  }
}

INSTANTIATE_TEST_SUITE_P(Volumes, TransmittanceCases,
                         testing::Values(Case{0.0f, 0.0f}, Case{-0.5f, -0.25f}, Case{0.0f, 0.125f},
                                         Case{0.0f, 0.0f, {}, {8, -16, 40}},
                                         Case{0.0f, 0.125f, {}, {512, 0, 0}},
                                         Case{0.0f, 0.0f, Box{{-11, -7, -3}, {5, 9, 2}}},
                                         Case{0.0f, 0.25f, Box{{-20, -3, -9}, {1, 30, 6}}},
                                         Case{-1.0f, 0.0f, Box{{-2, -13, 1}, {-1, 14, 3}}}));

// Closed forms.

TEST(Transmittance, OfABodyOfOneValueHasAClosedForm) {
  const Box box{{-3, 5, 100}, {8, 16, 111}};  // 12 voxels along each axis
  const auto body = [&](float value) { return volumeOf(box, [=](Coord) { return value; }); };
  const auto got = transmittancePsnr(body(0.5f), body(0.25f));
  ASSERT_TRUE(got);
  EXPECT_EQ(got->medianDepth, 6.0);
  const auto want = [](double t) { return -20.0 * std::log10(std::sqrt(t) - t); };
  expectNear(*got, {6.0, want(0.9), want(0.5), want(0.1)});
}

TEST(Transmittance, OfOneVoxelIsThatOfItsThreeColumns) {
  const SparseVolume voxel = volumeOf({{{7, -9, 3}, 4.0f}}), none = volumeOf({{{0, 0, 0}, 0.0f}});
  const auto got = transmittancePsnr(voxel, none);
  ASSERT_TRUE(got);
  const auto want = [](double t) { return -20.0 * std::log10(1.0 - t); };
  expectNear(*got, {4.0, want(0.9), want(0.5), want(0.1)});
  expectExact(transmittancePsnr(voxel, voxel));
}

/// Each column of the box counts once, so that the largest picture counts most.
TEST(Transmittance, IsTheMeanOverTheColumnsOfAllPictures) {
  const SparseVolume row = volumeOf({{{0, 0, 0}, 1.0f}, {{0, 0, 9}, 1.0f}});
  const SparseVolume one = volumeOf({{{0, 0, 0}, 1.0f}});
  const auto got = transmittancePsnr(row, one);
  ASSERT_TRUE(got);
  // There are 10 + 10 + 1 columns. The end of the row is missing in two pictures, and the column
  // along it has half of its depth.
  const double t = 0.5, squares = 2.0 * std::pow(1.0 - t, 2) + std::pow(t * t - t, 2);
  EXPECT_EQ(got->medianDepth, 1.0);
  EXPECT_NEAR(got->psnr50, -10.0 * std::log10(squares / 21.0), 1e-9);
}

/// Haze of a twenty-thousandth of the largest value has no say in the median, and haze of a hundredth has.
TEST(Transmittance, LeavesTheFaintestColumnsOutOfTheMedian) {
  const auto body = [](float haze) {
    return volumeOf(Box{{0, 0, 0}, {9, 9, 0}}, [=](Coord c) { return c.x < 3 ? 2.0f : haze; });
  };
  EXPECT_EQ(medianDepth(body(1e-4f)), 2.0);
  EXPECT_NEAR(*medianDepth(body(2e-2f)), 2e-2, 1e-8);
}

// Equal volumes.

TEST(Transmittance, HasNoErrorWhereTheVisibleValuesAreEqual) {
  const Box box{{0, 0, 0}, {20, 11, 9}};
  const auto value = [](Coord c) { return float((c.x * 7 + c.y * 3 + c.z) % 11 - 3); };
  const SparseVolume a = volumeOf(box, value);
  expectExact(transmittancePsnr(a, a));
  expectExact(
      transmittancePsnr(a, volumeOf(box, [&](Coord c) { return std::max(value(c), 0.0f); })));
  SparseVolume inactive = a;
  for (BrickMask& mask : inactive.active) mask = {};
  expectExact(transmittancePsnr(a, inactive));
  const Box larger{{-30, -8, -8}, {25, 30, 11}};
  expectExact(transmittancePsnr(
      a, volumeOf(larger, [&](Coord c) { return box.contains(c) ? value(c) : 0.0f; })));
}

TEST(Transmittance, DoesNotCountVoxelsOutsideTheBox) {
  const Box box{{0, 0, 0}, {9, 9, 9}};
  const auto value = [&](Coord c) { return box.contains(c) ? float(c.x) : 100.0f; };
  const SparseVolume a = volumeOf(box, value);
  const SparseVolume b = volumeOf(Box{{-9, 0, 0}, {20, 12, 9}}, value);
  expectExact(transmittancePsnr(a, b));
  expectExact(transmittancePsnr(b, a, box));
}

// Extreme values.

TEST(Transmittance, DoesNotDependOnTheUnitOfTheValues) {
  const SparseVolume a = randomVolume({.seed = 3}), b = randomVolume({.seed = 4});
  const auto want = transmittancePsnr(a, b);
  for (const float factor : {std::ldexp(1.0f, 100), std::ldexp(1.0f, -100)}) {
    SparseVolume c = a, d = b;
    for (float& v : c.values) v *= factor;
    for (float& v : d.values) v *= factor;
    const auto got = transmittancePsnr(c, d);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->psnr90, want->psnr90);
    EXPECT_EQ(got->psnr10, want->psnr10);
  }
}

TEST(Transmittance, OfTheLargestAndTheSmallestFloatsIsANumber) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr float kSmallest = std::numeric_limits<float>::denorm_min();
  const Box box{{0, 0, 0}, {40, 3, 3}};
  const auto full = [&](float value) { return volumeOf(box, [=](Coord) { return value; }); };
  for (const auto& [a, b] : {std::pair{kLargest, kSmallest}, std::pair{kSmallest, kLargest}}) {
    const auto got = transmittancePsnr(full(a), full(b));
    ASSERT_TRUE(got);
    for (const double psnr : {got->psnr90, got->psnr50, got->psnr10})
      EXPECT_TRUE(std::isfinite(psnr)) << psnr;
    expectExact(transmittancePsnr(full(a), full(a)));
  }
}

/// Dense pictures of this box would take 2^43 pixels.
TEST(Transmittance, OfVoxelsFarApartTakesNoDensePicture) {
  constexpr int kFar = 1 << 20;
  const SparseVolume both = volumeOf({{{0, 0, 0}, 1.0f}, {{kFar, kFar, kFar}, 1.0f}});
  const SparseVolume one = volumeOf({{{0, 0, 0}, 1.0f}});
  const auto got = transmittancePsnr(both, one);
  ASSERT_TRUE(got);
  EXPECT_NEAR(got->psnr50, 10.0 * std::log10(std::pow(kFar + 1.0, 2) / 0.25), 1e-9);
  SparseVolume fog = one;
  fog.background = 1e-30f;  // space that is a little denser
  EXPECT_TRUE(std::isfinite(transmittancePsnr(both, fog)->psnr50));
}

TEST(Transmittance, NamesAVoxelThatIsNotFinite) {
  const SparseVolume a = volumeOf({{{-3, 20, 9}, 1.0f}});
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    const SparseVolume b = volumeOf({{{-3, 20, 9}, bad}});
    EXPECT_THAT([&] { (void)transmittancePsnr(a, b); },
                test::ThrowsSaying<BadInput>("(-3, 20, 9)"));
    EXPECT_THROW((void)transmittancePsnr(b, a), BadInput);
  }
}

// What is measured at all.

TEST(Transmittance, IsNothingWithoutDepth) {
  const SparseVolume some = volumeOf({{{0, 0, 0}, 1.0f}});
  EXPECT_FALSE(transmittancePsnr(SparseVolume{}, some));
  EXPECT_FALSE(transmittancePsnr(volumeOf({{{0, 0, 0}, 0.0f}}), some));
  EXPECT_FALSE(transmittancePsnr(volumeOf({{{0, 0, 0}, -1.0f}}), some));
  EXPECT_FALSE(transmittancePsnr(volumeOf({{{0, 0, 0}, 1.0f}}, 0.5f), some));
  EXPECT_TRUE(transmittancePsnr(some, SparseVolume{}));
  EXPECT_EQ(medianDepth(some), 1.0);
  EXPECT_FALSE(medianDepth(SparseVolume{}));
}

TEST(Transmittance, IsNothingInABoxWithoutDepth) {
  const SparseVolume some = volumeOf({{{0, 0, 0}, 1.0f}, {{1, 0, 0}, 0.0f}, {{64, 0, 0}, 0.0f}});
  for (const Coord at : {Coord{1, 0, 0}, {9, 9, 9}, {64, 0, 0}, {1000, 0, 0}}) {
    const Box box{at, at};
    EXPECT_FALSE(medianDepth(some, box));
    EXPECT_FALSE(transmittancePsnr(some, some, box));
    EXPECT_THROW((void)metrics::TransmittanceReference(some, box).measure(some), UsageError);
  }
  EXPECT_EQ(medianDepth(some, Box{{0, 0, 0}, {1, 0, 0}}), 1.0);
}

TEST(Transmittance, IsForGridsThatAreLookedThrough) {
  const SparseVolume above = volumeOf({{{0, 0, 0}, 1.0f}}), below = volumeOf({{{0, 0, 0}, -1.0f}});
  EXPECT_TRUE(isLookedThrough(GridClass::kFogVolume, above));
  EXPECT_TRUE(isLookedThrough(GridClass::kFogVolume, below));
  EXPECT_TRUE(isLookedThrough(GridClass::kUnknown, above));
  EXPECT_FALSE(isLookedThrough(GridClass::kUnknown, below));
  EXPECT_FALSE(isLookedThrough(GridClass::kUnknown, SparseVolume{}));
  EXPECT_FALSE(isLookedThrough(GridClass::kLevelSet, above));
  EXPECT_FALSE(isLookedThrough(GridClass::kStaggered, above));
  EXPECT_FALSE(isLookedThrough(GridClass::kFogVolume, volumeOf({{{0, 0, 0}, 1.0f}}, 0.5f)));
}

TEST(Transmittance, IsAmongTheMetricsIfItIsAskedFor) {
  const SparseVolume a = randomVolume({.seed = 5}), b = randomVolume({.seed = 6});
  const Box box{{-9, -9, -9}, {9, 9, 9}};
  EXPECT_FALSE(compareVolumes(a, b).transmittance);
  const auto m = compareVolumes(a, b, {.box = box, .transmittance = true});
  ASSERT_TRUE(m.transmittance);
  EXPECT_TRUE(areSame(*m.transmittance, *transmittancePsnr(a, b, box)));
}

// Fields.

/// A field whose columns are all evaluated, and one of which 2048 bricks are taken along each axis.
TEST(MedianDepth, OfAFieldIsThatOfItsVoxels) {
  for (const double extent : {20.0, 160.0}) {
    Field field = test::randomField({.extent = extent, .smallest = extent / 12.0});
    for (float& intensity : field.chunks[0].ellipsoids.intensity) intensity = std::abs(intensity);
    const ValueRange range{-0.5f, 1.5f};
    const SparseVolume voxels = revoxelise(field, {.range = range});
    const auto want = medianDepth(voxels), got = medianDepth(field, activeBox(voxels), range);
    ASSERT_TRUE(want && got);
    const double tolerance = extent < 100.0 ? 1e-6 : 0.2;  // share of the depth
    EXPECT_NEAR(*got / *want, 1.0, tolerance) << voxels.brickCount() << " bricks";
  }
  EXPECT_FALSE(medianDepth(Field{}, Box{{0, 0, 0}, {9, 9, 9}}, {0.0f, 1.0f}));
  EXPECT_FALSE(medianDepth(Field{}, Box{}, {0.0f, 1.0f}));
}

// Determinism.

TEST(Transmittance, DoesNotDependOnThreadsOrOnTheOrigin) {
  const test::RandomVolumeOptions large{.seed = 11, .brickRange = 10, .brickShare = 0.4};
  const SparseVolume a = randomVolume(large);  // more bricks than one part of a projection
  test::RandomVolumeOptions other = large;
  other.seed = 12;
  const SparseVolume b = randomVolume(other);
  ASSERT_GT(a.brickCount(), 3000u);
  const auto measure = [&] { return *transmittancePsnr(a, b); };
  const auto want = test::onThreads(1, measure);
  EXPECT_TRUE(areSame(test::onThreads(4, measure), want));
  const Coord by{-8000, 64, 8};
  EXPECT_TRUE(areSame(*transmittancePsnr(movedBy(a, by), movedBy(b, by)), want));
}

// One reference for many candidates.

TEST(TransmittanceReference, MeasuresAsTransmittancePsnrDoes) {
  const SparseVolume a = randomVolume({.seed = 21});
  const metrics::TransmittanceReference reference(a);
  ASSERT_TRUE(reference.isDefined());
  SparseVolume alike = a;  // with the bricks of the reference
  for (float& value : alike.values) value *= 0.75f;
  for (const SparseVolume& candidate : {alike, randomVolume({.seed = 22}), SparseVolume{}})
    EXPECT_TRUE(areSame(reference.measure(candidate), *transmittancePsnr(a, candidate)));
}

}  // namespace
}  // namespace esvr
