// Plan: the errors of vectors are compared with figures that are computed by hand. All PSNR have
// the peak of the longest vector. A voxel that is active in one component counts in all.

#include <gtest/gtest.h>

#include <cmath>

#include "esvr/vector_metrics.h"

namespace esvr {
namespace {

/// A brick whose voxels all have this value.
SparseVolume constant(float value) {
  BrickInput brick{{}, {}, {}};
  brick.values.fill(value);
  brick.active.setAll();
  return makeVolume({brick}, 0.0f);
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

}  // namespace
}  // namespace esvr
