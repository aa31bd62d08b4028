// Plan: the PSNR of temporal differences is compared with figures that are computed by hand. Errors
// that both frames share must not count; errors that change must.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "esvr/error.h"
#include "esvr/temporal_metrics.h"
#include "metrics/volumes.h"

namespace esvr {
namespace {

using test::volumeOf;

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

}  // namespace
}  // namespace esvr
