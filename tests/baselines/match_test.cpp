// Plan: a search ends within its limit and near it, and its result is the best of its trials. FpN
// and ZFP reach a PSNR, and no smaller trial reaches it. Goals that cannot be reached are reported.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "baselines/grids.h"
#include "esvr/baseline.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

class Matching : public testing::Test {
 protected:
  VolumeGrid grid_ = test::ballGrid();
  test::TemporaryFolder folder_;
  BaselineEncoder encoder_{
      {.grid = grid_, .box = activeBox(grid_.volume), .folder = folder_.path()}};
};

void expectBestOfSteps(const Match& match) {
  for (const auto& step : match.steps) {
    if (std::isnan(step.psnr)) continue;
    EXPECT_LE(step.psnr, match.best.psnr) << toString(step.setting);
  }
}

class MatchingForms : public Matching, public testing::WithParamInterface<const char*> {};

TEST_P(MatchingForms, fillsTheSizeAskedFor) {
  const auto like = parseBaseline(GetParam());
  const std::uint64_t all = encoder_.encode(like).bytes;
  const std::uint64_t bytes = all * 6 / 10;
  const Match match = matchSize(encoder_, like, bytes);
  ASSERT_TRUE(match.found);
  EXPECT_LE(match.best.bytes, bytes);
  // The ball has about 400 distinct values, so a step of the threshold changes the bytes by less
  // than 1 %.
  EXPECT_GE(double(match.best.bytes), 0.9 * double(bytes));
  EXPECT_GT(match.best.setting.threshold, 0.0);
  EXPECT_EQ(encoder_.encode(match.best.setting).bytes, match.best.bytes) << "the row's command";
}

INSTANTIATE_TEST_SUITE_P(All, MatchingForms,
                         testing::Values("vdb-half-blosc", "nvdb-float-zip", "nvdb-fp16-zip",
                                         "nvdb-fp8-zip", "nvdb-fp4-zip"));

TEST_F(Matching, takesAllVoxelsWhereThereIsRoom) {
  const Match match = matchSize(encoder_, parseBaseline("vdb-half-blosc"), 10'000'000);
  ASSERT_TRUE(match.found);
  EXPECT_EQ(match.best.setting.threshold, 0.0);
  EXPECT_EQ(match.steps.size(), 1u);
}

TEST_F(Matching, findsNothingBelowTheSmallestFile) {
  const Match match = matchSize(encoder_, parseBaseline("nvdb-fp8"), 5000);
  EXPECT_FALSE(match.found);
  EXPECT_FALSE(match.steps.empty()) << "the search is shown";
}

TEST_F(Matching, looksForFpNsBestTolerance) {
  const std::uint64_t bytes = 4000;
  const Match match = matchSize(encoder_, parseBaseline("nvdb-fpn-zip,tolerance=1"), bytes);
  ASSERT_TRUE(match.found);
  EXPECT_LE(match.best.bytes, bytes);
  expectBestOfSteps(match);
}

TEST_F(Matching, reachesAPsnrWithFpN) {
  const Match match = matchPsnr(encoder_, parseBaseline("nvdb-fpn-zip,tolerance=1"), {45.0});
  ASSERT_TRUE(match.found);
  EXPECT_GE(match.best.psnr, 45.0);
  for (const auto& step : match.steps) {
    if (step.psnr < 45.0) continue;
    EXPECT_GE(step.bytes, match.best.bytes);
  }
}

TEST_F(Matching, matchesSizeAndPsnrWithZfp) {
  if (zfpVersion().empty()) GTEST_SKIP() << "built without ZFP";
  for (const char* like : {"zfp,accuracy=1", "zfp,precision=1", "zfp-bricks,accuracy=1"}) {
    const Match size = matchSize(encoder_, parseBaseline(like), 6000);
    ASSERT_TRUE(size.found) << like;
    EXPECT_LE(size.best.bytes, 6000u);
    expectBestOfSteps(size);
    const Match psnr = matchPsnr(encoder_, parseBaseline(like), {45.0});
    ASSERT_TRUE(psnr.found) << like;
    EXPECT_GE(psnr.best.psnr, 45.0);
  }
}

TEST_F(Matching, dropsVoxelsDownToAPsnrOverTheActiveVoxels) {
  const MatchGoal goal{.psnr = 22.0, .active = true, .dropsVoxels = true};
  const Match match = matchPsnr(encoder_, parseBaseline("nvdb-fp4-zip"), goal);
  ASSERT_TRUE(match.found);
  EXPECT_GT(match.best.setting.threshold, 0.0);
  encoder_.encode(match.best.setting);
  const auto metrics = compareVolumes(grid_.volume, encoder_.decode());
  EXPECT_EQ(metrics.psnrActive, match.best.psnr) << "not that over the box";
  EXPECT_GE(match.best.psnr, goal.psnr);
  // The values of the ball are multiples of 1/144, of which at most two in a row are missing, as
  // those of r^2 = 111 and 112, which are no sums of three squares.
  auto next = match.best.setting;
  next.threshold += 3.01 / 144;
  encoder_.encode(next);
  EXPECT_LT(compareVolumes(grid_.volume, encoder_.decode()).psnrActive, goal.psnr);
}

TEST_F(Matching, triesTolerancesWithThresholds) {
  const auto like = parseBaseline("nvdb-fpn-zip,tolerance=1");
  MatchGoal goal{.psnr = 22.0, .active = true};
  const Match all = matchPsnr(encoder_, like, goal);
  goal.dropsVoxels = true;
  const Match some = matchPsnr(encoder_, like, goal);
  ASSERT_TRUE(all.found && some.found);
  EXPECT_LE(some.best.bytes, all.best.bytes);
  EXPECT_GE(some.best.psnr, goal.psnr);
  const auto hasThreshold = [](const MatchStep& step) { return step.setting.threshold > 0.0; };
  EXPECT_TRUE(std::ranges::any_of(some.steps, hasThreshold));
}

TEST_F(Matching, findsNoThresholdWhereAllVoxelsAreTooCoarse) {
  const MatchGoal goal{.psnr = 90.0, .active = true, .dropsVoxels = true};
  EXPECT_FALSE(matchPsnr(encoder_, parseBaseline("nvdb-fp4-zip"), goal).found);
}

TEST_F(Matching, knowsNoPsnrOfOtherForms) {
  EXPECT_THROW((void)matchPsnr(encoder_, parseBaseline("vdb-half-blosc"), {40.0}), UsageError);
}

TEST_F(Matching, stopsWhenCancelled) {
  CancelToken token;
  BaselineEncoder encoder(
      {.grid = grid_, .box = activeBox(grid_.volume), .folder = folder_.path(), .cancel = &token});
  token.cancel();
  EXPECT_THROW((void)matchSize(encoder, parseBaseline("vdb-half-blosc"), 1000), Cancelled);
}

}  // namespace
}  // namespace esvr
