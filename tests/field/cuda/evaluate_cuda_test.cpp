// Plan: on a GPU every value must lie within the stated bounds of the float64 sum and of
// evaluateBricks, over the kernel's edge, needles and pancakes, own kappas and several chunks, more
// ellipsoids in a brick than one stage holds, one brick and thousands; far origins, other bricks
// and further runs must not change a bit. Without a GPU the call must say why.

#include "esvr/cuda/field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/cube.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using test::cube;
using test::intensitySum;
using test::randomField;
using test::RandomFieldOptions;
using testing::Each;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(EvaluateBricksCuda, SaysWhichDeviceIsNotThere) {
  std::vector<float> out(kBrickVoxels);
  const std::vector<Coord> corners(1);
  EXPECT_THAT(
      [&] {
        evaluateBricksCuda({}, corners, out, {DeviceKind::kCuda, 12345});
      },
      ThrowsMessage<DeviceError>(HasSubstr("cuda:12345: ")));
}

TEST(EvaluateBricksCuda, RefusesTheCpu) {
  EXPECT_THROW(evaluateBricksCuda({}, {}, {}, {DeviceKind::kCpu}), DeviceError);
}

class EvaluateOnGpu : public testing::Test {
 protected:
  void SetUp() override {
    try {
      device_ = selectDevice("cuda");
    } catch (const DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  /// What is not written stays NaN and fails every comparison.
  std::vector<float> evaluate(const Field& field, const std::vector<Coord>& corners) const {
    std::vector<float> values(corners.size() * kBrickVoxels, std::nanf(""));
    evaluateBricksCuda(field, corners, values, device_);
    return values;
  }

  void expectTheCpusValues(const Field& field, const std::vector<Coord>& corners,
                           double tolerance) const {
    const auto values = evaluate(field, corners);
    std::vector<float> onCpu(values.size());
    evaluateBricks(field, corners, onCpu);
    for (std::size_t v = 0; v < values.size(); ++v)
      ASSERT_NEAR(values[v], onCpu[v], 2 * tolerance) << "value " << v;
  }

  /// Every seventh voxel: over neighbouring bricks that is every place in a row.
  void expectTheFloat64Sum(const Field& field, const std::vector<Coord>& corners,
                           double tolerance) const {
    const auto values = evaluate(field, corners);
    for (std::size_t v = 0; v < values.size(); v += 7) {
      const Coord voxel = corners[v / kBrickVoxels] + voxelLocal(int(v % kBrickVoxels));
      ASSERT_NEAR(values[v], evaluateReference(field, voxel), tolerance) << toString(voxel);
    }
  }

  void expectParity(const Field& field, const std::vector<Coord>& corners, double tolerance) const {
    expectTheFloat64Sum(field, corners, tolerance);
    expectTheCpusValues(field, corners, tolerance);
  }

  Device device_;
};

class EvaluateKappaOnGpu : public EvaluateOnGpu, public testing::WithParamInterface<float> {};

// m is off by a few times 2^-24 m, and phi by that times its slope, which grows with kappa. The
// hardware's exponential and reciprocal add 2 ulp each to phi.
TEST_P(EvaluateKappaOnGpu, AgreesWithTheCpuAndTheFloat64Sum) {
  const Field field = randomField({.count = 30, .extent = 32, .kappa = GetParam()});
  const double steepness = std::max(1.0, double(GetParam()));
  expectParity(field, cube({-8, -8, -8}, 6), 4e-7 * steepness * intensitySum(field));
}
INSTANTIATE_TEST_SUITE_P(Kernels, EvaluateKappaOnGpu,
                         testing::Values(-30.f, -3.f, 0.f, 2.f, 5.f, 50.f, 5000.f));

class EvaluateAspectOnGpu : public EvaluateOnGpu,
                            public testing::WithParamInterface<std::pair<double, double>> {};

// Terms of u cancel by up to the aspect ratio, so their rounding weighs as much more.
TEST_P(EvaluateAspectOnGpu, StaysAccurateForNeedlesAndPancakes) {
  const auto [aspect, tolerance] = GetParam();
  const Field field = randomField(
      {.count = 30, .extent = 24, .smallest = 0.3, .aspect = aspect, .intensity = 1.0, .seed = 11});
  expectParity(field, cube({0, 0, 0}, 3), tolerance);
}
INSTANTIATE_TEST_SUITE_P(Aspects, EvaluateAspectOnGpu,
                         testing::Values(std::pair{10.0, 1e-5}, std::pair{100.0, 3e-5},
                                         std::pair{1000.0, 3e-4}));

TEST_F(EvaluateOnGpu, UsesEachPrimitivesOwnKappaWhereGiven) {
  Field field = randomField({.count = 30, .extent = 16});
  auto& e = field.chunks[0].ellipsoids;
  for (std::size_t i = 0; i < e.size(); ++i) e.kappa.push_back(float(i) - 15.0f);
  expectParity(field, cube({-8, -8, -8}, 4), 5e-6 * intensitySum(field));
}

TEST_F(EvaluateOnGpu, AddsChunksOfDifferentOriginsAndKernels) {
  Field field = randomField({.count = 10, .extent = 16});
  field.chunks.push_back(
      randomField({.count = 10, .extent = 16, .origin = {-5, 3, 9}, .seed = 3}).chunks[0]);
  field.chunks.push_back({});
  field.chunks[1].ellipsoids.kappa.assign(10, 8.0f);
  expectParity(field, cube({-16, -16, -16}, 5), 3e-6 * intensitySum(field));
}

// It jumps by 0.6 % where its support ends, and rounding decides on which side of the end a voxel
// lies: about one in 2^20 that are near.
TEST_F(EvaluateOnGpu, KeepsThePapersKernelUpToVoxelsAtItsJump) {
  Field field = randomField({.count = 30, .extent = 16, .kappa = 5.0f});
  field.kernel.form = KernelForm::kPaper;
  const auto corners = cube({-8, -8, -8}, 4);
  const auto values = evaluate(field, corners);
  std::vector<float> onCpu(values.size());
  evaluateBricks(field, corners, onCpu);
  int different = 0;
  for (std::size_t v = 0; v < values.size(); ++v)
    different += !(std::abs(values[v] - onCpu[v]) < 4e-6 * intensitySum(field));
  EXPECT_LE(different, 3);
}

TEST_F(EvaluateOnGpu, TakesMoreEllipsoidsInABrickThanOneStage) {
  const Field field = randomField({.count = 1000, .extent = 8, .smallest = 1.0, .kappa = 0.0f});
  expectParity(field, {{0, 0, 0}}, 4e-7 * intensitySum(field));
}

TEST_F(EvaluateOnGpu, ScalesWithVerySmallAndVeryLargeIntensities) {
  for (const double size : {1e-30, 1e30}) {
    const Field field = randomField({.count = 30, .extent = 16, .intensity = size});
    expectParity(field, cube({}, 2), 8e-7 * intensitySum(field));
  }
}

TEST_F(EvaluateOnGpu, GivesTheBackgroundWhereNothingReaches) {
  Field field = randomField({.count = 3});
  field.background = 0.25f;
  EXPECT_THAT(evaluate(field, {{800, 0, 0}}), Each(0.25f));
  field.chunks.clear();
  EXPECT_THAT(evaluate(field, cube({}, 2)), Each(0.25f));
}

TEST_F(EvaluateOnGpu, TakesNoBricks) { EXPECT_TRUE(evaluate(randomField({}), {}).empty()); }

TEST_F(EvaluateOnGpu, IsTheSameBitsAtTenMillionVoxels) {
  const RandomFieldOptions near{.count = 20, .extent = 16};
  RandomFieldOptions far = near;
  far.origin = {10'000'000, -10'000'000, 10'000'000};
  EXPECT_EQ(evaluate(randomField(near), cube({}, 2)),
            evaluate(randomField(far), cube(far.origin, 2)));
}

TEST_F(EvaluateOnGpu, IsTheSameBitsInEveryRunOverThousandsOfBricks) {
  const Field field = randomField({.count = 20000, .extent = 136});
  const auto corners = cube({}, 17);
  const auto first = evaluate(field, corners);
  EXPECT_EQ(evaluate(field, corners), first);
  EXPECT_EQ(evaluate(field, corners), first);
  expectTheCpusValues(field, corners, 8e-7 * intensitySum(field));
}

TEST_F(EvaluateOnGpu, DoesNotDependOnTheOtherBricks) {
  const Field field = randomField({.count = 50, .extent = 24});
  const auto many = evaluate(field, cube({}, 3));
  const auto one = evaluate(field, {{0, 0, 0}});
  EXPECT_TRUE(std::equal(one.begin(), one.end(), many.begin()));
}

TEST_F(EvaluateOnGpu, RefusesRoomForAnotherNumberOfBricks) {
  std::vector<float> out(kBrickVoxels);
  EXPECT_THROW(evaluateBricksCuda({}, cube({}, 2), out, device_), std::logic_error);
}

}  // namespace
}  // namespace esvr
