// Plan: bricks that the decoder of the renderers makes on a GPU are compared with the definition in
// float64, for fields of several kernels, shapes and origins. Bricks that no ellipsoid reaches hold
// the background. On the CPU, the bricks are those of evaluateBricks().

#include "esvr/device_bricks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/random_field.h"
#include "support/on_device.h"

namespace esvr::test {
namespace {

class DeviceBricks : public OnDevice {
 protected:
  [[nodiscard]] Stability measured(const Field& field) const {
    StabilityOptions options;
    options.evaluate = [&](const Field& f, std::span<const Coord> corners, std::span<float> out) {
      evaluateBricksOn(device_, f, corners, out);
    };
    options.arithmetic = arithmeticOf(device_);
    return measureStability(field, options);
  }
};

TEST_P(DeviceBricks, StayWithinTheBoundOfTheirArithmetic) {
  for (const RandomFieldOptions& shape : std::initializer_list<RandomFieldOptions>{
           {},
           {.smallest = 0.1, .aspect = 1000.0},
           {.kappa = -30.0f},
           {.kappa = 30.0f},
           {.count = 5000, .extent = 8.0, .smallest = 0.3},
           {.intensity = 1e-30},
           {.intensity = 1e30},
           {.origin = {10'000'000, -10'000'000, 10'000'000}}}) {
    const Stability s = measured(randomField(shape));
    EXPECT_GT(s.largest, 0.0) << "no rounding at all proves nothing";
    EXPECT_LT(s.shareOfBound, 1.0) << "kappa " << shape.kappa << ", aspect " << shape.aspect;
  }
}

TEST_P(DeviceBricks, HoldTheBackgroundWhereNothingReaches) {
  Field field = randomField({.count = 3});
  field.background = 0.25f;
  const std::vector<Coord> corners{{-800, 0, 0}, {0, 0, 0}, {800, 0, 0}};
  std::vector<float> values(corners.size() * kBrickVoxels);
  evaluateBricksOn(device_, field, corners, values);
  const std::span all(values);
  EXPECT_THAT(all.first(kBrickVoxels), testing::Each(0.25f));
  EXPECT_THAT(all.last(kBrickVoxels), testing::Each(0.25f));
}

TEST_P(DeviceBricks, AreTheSameInAnyCompany) {
  const Field field = randomField({.count = 2000, .extent = 100.0});
  const auto corners = reachedBricks(field);
  ASSERT_GT(corners.size(), 600u) << "the bricks of several batches";
  std::vector<float> all(corners.size() * kBrickVoxels), one(kBrickVoxels);
  evaluateBricksOn(device_, field, corners, all);
  const std::size_t chosen = corners.size() / 2;
  evaluateBricksOn(device_, field, std::span(corners).subspan(chosen, 1), one);
  EXPECT_THAT(
      one, testing::ElementsAreArray(std::span(all).subspan(chosen * kBrickVoxels, kBrickVoxels)));
}

ESVR_ON_DEVICES(DeviceBricks);

}  // namespace
}  // namespace esvr::test
