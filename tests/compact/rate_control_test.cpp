// Plan: files of the size asked for and never above it, files of the PSNR asked for and not far
// above it, and what is out of reach said so.

#include "esvr/rate_control.h"

#include <gtest/gtest.h>

#include "../fit/volumes.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

RateInput inputOf(const SparseVolume& volume) {
  static const GridDescriptor descriptor;
  FitOptions options;
  options.iterations = 120;
  options.kappa = 2.0f;
  return {descriptor, volume, options};
}

std::uint64_t bytesIn(const StoredGrid& grid) {
  return encodeEsvr({{}, {grid}}).size() - encodeEsvr({}).size();
}
double psnrOf(const SparseVolume& volume, const StoredGrid& grid) {
  return compareVolumes(volume, decodeGrid(grid)).psnrBox;
}

TEST(FitToSize, LandsWithinTwoPerCentUnderTheSize) {
  const SparseVolume volume = test::tubeVolume();
  for (const std::uint64_t bytes : {900u, 1500u}) {
    const RatedGrid rated = fitToSize(inputOf(volume), bytes);
    EXPECT_LE(bytesIn(rated.grid), bytes);
    EXPECT_GE(double(bytesIn(rated.grid)), 0.98 * double(bytes));
    EXPECT_TRUE(rated.grid.curve.empty());
  }
}

TEST(FitToSize, IsBetterTheMoreBytesThereAre) {
  const SparseVolume volume = test::tubeVolume();
  EXPECT_GT(psnrOf(volume, fitToSize(inputOf(volume), 1500).grid),
            psnrOf(volume, fitToSize(inputOf(volume), 800).grid) + 2.0);
}

TEST(FitToSize, RefusesWhatCannotHoldTheGrid) {
  const SparseVolume volume = test::tubeVolume();
  EXPECT_THROW((void)fitToSize(inputOf(volume), 100), UsageError);
}

TEST(FitToPsnr, ReachesItAndLittleMore) {
  const SparseVolume volume = test::tubeVolume();
  const RatedGrid rated = fitToPsnr(inputOf(volume), 32.0);
  EXPECT_EQ(rated.fit.end, FitEnd::kPsnrReached);
  const double reached = psnrOf(volume, rated.grid);
  EXPECT_GE(reached, 32.0);
  EXPECT_LT(reached, 32.5);
}

TEST(FitToPsnr, SaysSoWhereItIsOutOfReach) {
  // noise: no sum of fewer ellipsoids than voxels comes near
  test::Random random(3);
  const SparseVolume noise =
      test::volumeOf({}, 1, 0.0f, [&](Coord) { return float(random(0.5, 1.0)); });
  RateInput input = inputOf(noise);
  input.options.iterations = 20;
  EXPECT_EQ(fitToPsnr(input, 120.0).fit.end, FitEnd::kPsnrMissed);
}

TEST(RateControl, GivesTheSameBytesAgain) {
  const SparseVolume volume = test::tubeVolume();
  EXPECT_EQ(encodeEsvr({{}, {fitToSize(inputOf(volume), 1000).grid}}),
            encodeEsvr({{}, {fitToSize(inputOf(volume), 1000).grid}}));
}

}  // namespace
}  // namespace esvr
