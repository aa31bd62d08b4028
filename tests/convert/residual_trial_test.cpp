// Plan: the ratio of a sample is below 1 for a volume whose ellipsoids with a residual are smaller
// than voxels, and above 1 for noise. A second trial gives the same bits.

#include "convert/residual_trial.h"

#include <gtest/gtest.h>

#include "convert/volumes.h"

namespace esvr {
namespace {

double ratioOf(const SparseVolume& volume, double bound) {
  const GridDescriptor descriptor;
  const ConvertInput input{descriptor, volume};
  const ConvertOptions options;
  return convert::residualRatio({input, options}, bound, 0.25);
}

TEST(ResidualTrial, HasASmallRatioForBlobs) { EXPECT_LT(ratioOf(test::smoothVolume(), 0.1), 0.9); }

TEST(ResidualTrial, HasALargeRatioForNoise) { EXPECT_GT(ratioOf(test::noiseVolume(3), 0.01), 1.1); }

TEST(ResidualTrial, GivesTheSameRatioAgain) {
  const SparseVolume volume = test::smoothVolume();
  EXPECT_EQ(ratioOf(volume, 0.05), ratioOf(volume, 0.05));
}

}  // namespace
}  // namespace esvr
