// Plan: fields of all shapes, kernels and sizes are evaluated in float32 and measured. The difference
// must stay below the bound of the arithmetic, and the bound within a factor of what it bounds, so
// that it says something. A wrong evaluation, or one that is not finite, is found and named. The
// figures of small fields are known by hand: overlap, cancellation and correct digits.

#include "esvr/stability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tbb/global_control.h>
#include <cmath>
#include <limits>

#include "esvr/field.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using test::RandomFieldOptions;

struct StabilityShape {
  const char* name;
  RandomFieldOptions field;
  KernelForm form = KernelForm::kContinuous;
};
std::ostream& operator<<(std::ostream& out, const StabilityShape& shape) {
  return out << shape.name;
}

Field fieldOfShape(const StabilityShape& shape) {
  Field field = test::randomField(shape.field);
  field.kernel.form = shape.form;
  return field;
}

class Rounding : public testing::TestWithParam<StabilityShape> {};

// The bound adds the largest errors of all operations, as if all had the same sign. A typical error is
// the square root of their number, some 10 times smaller, in a typical direction, which is again
// smaller: it reaches between 1/1000 and 1/2 of the bound.
TEST_P(Rounding, StaysWithinItsBound) {
  const Stability s = measureStability(fieldOfShape(GetParam()));
  EXPECT_GT(s.largest, 0.0) << "no rounding at all proves nothing";
  EXPECT_LT(s.shareOfBound, 1.0);
  EXPECT_GT(s.shareOfBound, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, Rounding,
    testing::Values(StabilityShape{"usual", {}},
                    StabilityShape{"needles", {.smallest = 0.1, .aspect = 1000.0}},
                    StabilityShape{"subvoxel", {.smallest = 0.1, .aspect = 2.0}},
                    StabilityShape{"huge", {.count = 5, .smallest = 150.0, .aspect = 2.0}},
                    StabilityShape{"gaussian", {.kappa = -30.0f}},
                    StabilityShape{"hard", {.smallest = 0.5, .kappa = 30.0f}},
                    StabilityShape{"box", {.smallest = 0.1, .kappa = 5000.0f}},
                    StabilityShape{"faint", {.intensity = 1e-30}},
                    StabilityShape{"bright", {.intensity = 1e30}},
                    StabilityShape{"crowd", {.count = 5000, .extent = 8.0, .smallest = 0.3}},
                    StabilityShape{"far", {.origin = {10'000'000, -10'000'000, 10'000'000}}},
                    StabilityShape{"farInItsChunk", {.extent = 4096.0}},
                    StabilityShape{"paper", {.kappa = 5.0f}, KernelForm::kPaper},
                    StabilityShape{"paperSoft", {.kappa = 0.5f}, KernelForm::kPaper}),
    [](const auto& shape) { return std::string(shape.param.name); });

// A float32 has 23 bits below its first one, and the smallest one is 2^-149. A sum of values near it is
// exact to a few of these.
TEST(Rounding, OfDenormalNumbersIsThatOfTheSmallestOnes) {
  const Stability s = measureStability(fieldOfShape({"", {.intensity = 1e-40}}));
  EXPECT_LT(s.shareOfBound, 1.0);
  EXPECT_LT(s.largest, 40 * 0x1p-149);
}

TEST(Stability, NamesTheVoxelOfAWrongValue) {
  const Field field = fieldOfShape({"", {}});
  const Coord wrong{10, 21, 33};
  StabilityOptions options;
  options.worst = 2;
  options.evaluate = [&](const Field& f, std::span<const Coord> corners, std::span<float> out) {
    evaluateBricks(f, corners, out);
    const auto at = std::ranges::find(corners, brickOf(wrong) * kBrickSide) - corners.begin();
    out[std::size_t(at * kBrickVoxels + voxelOffset(localOf(wrong)))] += 0.5f;
  };
  const Stability s = measureStability(field, options);
  EXPECT_NEAR(s.largest, 0.5, 1e-4);
  ASSERT_EQ(s.worst.size(), 2u);
  EXPECT_EQ(s.worst[0].at, wrong);
  EXPECT_EQ(s.worst[0].corner, (Coord{8, 16, 32}));
  EXPECT_LT(s.worst[1].largest, 1e-4);
  EXPECT_NEAR(s.rms, 0.5 / std::sqrt(double(s.sampled) * kBrickVoxels), 1e-5);
  EXPECT_GT(s.shareOfBound, 100.0);
}

TEST(Stability, FindsValuesThatAreNotFinite) {
  StabilityOptions options;
  options.evaluate = [](const Field&, std::span<const Coord>, std::span<float> out) {
    std::ranges::fill(out, std::numeric_limits<float>::quiet_NaN());
  };
  const Stability s = measureStability(fieldOfShape({"", {}}), options);
  EXPECT_EQ(s.largest, std::numeric_limits<double>::infinity());
  EXPECT_EQ(correctDigits(s.largest, s.peak), 0);
}

TEST(Stability, ComparesWhatIsLeftOfClampedValues) {
  StabilityOptions options;
  options.range = ValueRange{0.0f, 0.0f};
  EXPECT_EQ(measureStability(fieldOfShape({"", {}}), options).largest, 0.0);
}

/// Spheres with a support of less than three voxels, all with the same center.
Field spheresAtOneVoxel(std::initializer_list<float> intensities) {
  Field field = test::randomField({.count = intensities.size(), .extent = 1.0});
  Ellipsoids& e = field.chunks[0].ellipsoids;
  for (auto& center : e.center) std::ranges::fill(center, 3.0f);
  for (auto& scale : e.logScale) std::ranges::fill(scale, 0.0f);
  e.intensity = intensities;
  return field;
}

TEST(Stability, CountsOverlapAndCancellation) {
  const Stability one = measureStability(spheresAtOneVoxel({2.0f}));
  EXPECT_EQ(one.meanOverlap, 1.0);
  EXPECT_EQ(one.largestOverlap, 1u);
  EXPECT_EQ(one.meanCancellation, 1.0);
  EXPECT_NEAR(one.peak, 2.0, 1e-12);
  const Stability three = measureStability(spheresAtOneVoxel({2.0f, -1.0f, 1.0f}));
  EXPECT_EQ(three.meanOverlap, 3.0);
  EXPECT_EQ(three.largestOverlap, 3u);
  EXPECT_NEAR(three.meanCancellation, 2.0, 1e-12);
  EXPECT_NEAR(three.largestCancellation, 2.0, 1e-12);
}

TEST(Stability, IsThatOfNothingWithoutEllipsoids) {
  const Stability s = measureStability(Field{});
  EXPECT_EQ(s.sampled, 0u);
  EXPECT_EQ(s.largest, 0.0);
  EXPECT_EQ(s.extremes.smallestScale, 0.0);
  EXPECT_TRUE(s.worst.empty());
}

TEST(Stability, TakesSamplesEvenlyAndWhereTheExtremesAre) {
  const Field field = fieldOfShape({"", {.count = 300, .extent = 200.0}});
  StabilityOptions options;
  options.samples = 10, options.worst = 100;
  const Stability s = measureStability(field, options);
  EXPECT_GE(s.sampled, 10u);
  EXPECT_LE(s.sampled, 14u);
  EXPECT_EQ(s.bricks, reachedBricks(field).size());
  options.within = {{0, 0, 0}, {7, 7, 7}};
  EXPECT_LE(measureStability(field, options).bricks, 1u);
  const std::vector<Coord> given{{0, 0, 0}, {0, 0, 8}};
  options.bricks = given;
  EXPECT_EQ(measureStability(field, options).sampled, 2u);
}

TEST(Stability, DoesNotDependOnTheNumberOfThreads) {
  const Field field = fieldOfShape({"", {.count = 200}});
  const auto figures = [&] {
    const Stability s = measureStability(field);
    return std::array{s.largest, s.rms, s.bound, s.meanOverlap, s.meanCancellation};
  };
  const auto all = figures();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(figures(), all);
}

TEST(CorrectDigits, AreThoseBelowThePeak) {
  EXPECT_EQ(correctDigits(0.0, 1.0), 17);
  EXPECT_EQ(correctDigits(1e-4, 1.0), 4);
  EXPECT_EQ(correctDigits(9e-4, 1.0), 3);
  EXPECT_EQ(correctDigits(1e-4, 100.0), 6);
  EXPECT_EQ(correctDigits(2.0, 1.0), 0);
  EXPECT_EQ(correctDigits(1e-30, 0.0), 0);
  EXPECT_EQ(correctDigits(std::numeric_limits<double>::quiet_NaN(), 1.0), 0);
}

}  // namespace
}  // namespace esvr
