// Plan: the text of every setting is parsed to the same setting. Other texts are refused with a list of the valid ones.
//
// Each form stores a soft ball and gives back its voxels. Lossless forms give back every voxel, half floats are within half
// a unit in the last place, quantised forms within a step of the leaf's range, and FpN and ZFP within their bounds. Forms
// that do not fit the grid are refused.
//
// A search ends within its limit and near it, and its result is the best of its trials. FpN and ZFP reach a PSNR, and no
// smaller trial reaches it. Goals that cannot be reached are reported.
//
// The voxels of a box become an array and a volume again, across bricks and where the box cuts
// bricks. The tests check the order of the array, the active voxels that come back, and the limit on memory.
// The bricks of a volume become a stack and a volume again, and their positions become bytes and positions
// again. Bytes that end too early are refused. Voxels are dropped at a threshold in a fog volume, with a
// background other than 0, and in a level set, whose band becomes narrower from its edge.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "baselines/voxels.h"
#include "esvr/baseline.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "metrics/volumes.h"
#include "support/files.h"
#include "support/messages.h"

namespace esvr {
namespace {

/// A soft ball of radius 12 around (20, 20, 20), whose values fall from 1 to 0.
VolumeGrid ballGrid() {
  VolumeGrid grid;
  grid.descriptor.name = "density";
  grid.descriptor.gridClass = GridClass::kFogVolume;
  grid.descriptor.transform = uniformTransform(0.5);
  std::vector<test::Voxel> voxels;
  for (int x = 8; x <= 32; ++x)
    for (int y = 8; y <= 32; ++y)
      for (int z = 8; z <= 32; ++z) {
        const int r2 = (x - 20) * (x - 20) + (y - 20) * (y - 20) + (z - 20) * (z - 20);
        if (r2 < 144) voxels.push_back({{x, y, z}, 1.0f - float(r2) / 144.0f});
      }
  grid.volume = test::volumeOf(voxels);
  return grid;
}

// Settings.

class SettingText : public testing::TestWithParam<const char*> {};

TEST_P(SettingText, comesBackAsItWas) {
  EXPECT_EQ(toString(parseBaseline(GetParam())), GetParam());
}

INSTANTIATE_TEST_SUITE_P(All, SettingText,
                         testing::Values("vdb-float-blosc", "vdb-half-zip", "vdb-half",
                                         "nvdb-float", "nvdb-fp16-zip", "nvdb-fp8-blosc",
                                         "nvdb-fp4,threshold=0.125",
                                         "nvdb-fpn-zip,tolerance=0.1,threshold=0.3",
                                         "nvdb-fpn,tolerance=1e-30", "zfp,accuracy=0.25",
                                         "zfp-bricks,accuracy=0.25", "zfp,precision=6"));

TEST(Setting, keepsAllDigits) {
  const double third = 1.0 / 3.0;
  const BaselineSetting setting{.how = VoxelPacking{PackedForm::kNanoFpN, PackedCodec::kZip, third},
                                .threshold = third / 7};
  const auto back = parseBaseline(toString(setting));
  EXPECT_EQ(std::get<VoxelPacking>(back.how).tolerance, third);
  EXPECT_EQ(back.threshold, third / 7);
}

class RefusedSetting : public testing::TestWithParam<const char*> {};

TEST_P(RefusedSetting, isNoBaseline) { EXPECT_THROW((void)parseBaseline(GetParam()), UsageError); }

INSTANTIATE_TEST_SUITE_P(All, RefusedSetting,
                         testing::Values("", "gzip", "vdb", "nvdb-fpn-zip",
                                         "nvdb-fpn-zip,tolerance=0", "nvdb-fpn-zip,tolerance=x",
                                         "nvdb-fp8,tolerance=0.1", "vdb-half,threshold",
                                         "vdb-half,threshold=-1", "vdb-half,threshold=inf", "zfp",
                                         "zfp,rate=4", "zfp,accuracy=0.1,threshold=0.1"));

TEST(Setting, listsTheValidSettings) {
  try {
    (void)parseBaseline("gzip");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), test::Says("gzip", "nvdb-fpn"));
  }
}

// Forms.

struct Form {
  const char* setting;
  double maxError;  ///< see the derivation at the table
};
std::ostream& operator<<(std::ostream& out, const Form& form) { return out << form.setting; }

class BaselineForm : public testing::TestWithParam<Form> {
 protected:
  VolumeGrid grid_ = ballGrid();
  test::TemporaryFolder folder_;
  BaselineEncoder encoder_{
      {.grid = grid_, .box = activeBox(grid_.volume), .folder = folder_.path()}};
};

TEST_P(BaselineForm, givesBackTheVoxelsWithinItsBound) {
  const auto encoded = encoder_.encode(parseBaseline(GetParam().setting));
  EXPECT_GT(encoded.bytes, 0u);
  EXPECT_GT(encoded.seconds, 0.0);
  EXPECT_GT(encoder_.secondsToDecode(), 0.0);
  const auto metrics = compareVolumes(grid_.volume, encoder_.decode());
  EXPECT_LE(metrics.maxError, GetParam().maxError);
  EXPECT_EQ(metrics.iou, 1.0);
}

// Values lie in (0, 1]. A half has a mantissa of 11 bits, so its error is at most 2^-12 near 1. A
// leaf's range is at most 1, and FpB divides it into 2^B - 1 steps; the error is half a step plus
// float rounding.
INSTANTIATE_TEST_SUITE_P(All, BaselineForm,
                         testing::Values(Form{"vdb-float-blosc", 0.0}, Form{"vdb-float-zip", 0.0},
                                         Form{"vdb-float", 0.0}, Form{"vdb-half-blosc", 1.0 / 4096},
                                         Form{"nvdb-float", 0.0}, Form{"nvdb-float-zip", 0.0},
                                         Form{"nvdb-float-blosc", 0.0},
                                         Form{"nvdb-fp16-zip", 0.51 / 65535},
                                         Form{"nvdb-fp8", 0.51 / 255},
                                         Form{"nvdb-fp4-blosc", 0.51 / 15},
                                         Form{"nvdb-fpn-zip,tolerance=0.01", 0.0101}));

TEST_P(BaselineForm, leavesNoFileBehind) {
  {
    BaselineEncoder encoder(
        {.grid = grid_, .box = activeBox(grid_.volume), .folder = folder_.path()});
    encoder.encode(parseBaseline(GetParam().setting));
  }
  EXPECT_EQ(folder_.names().size(), 0u);
}

class Encoder : public BaselineForm {};

TEST_F(Encoder, writesFewerBytesAtAHigherThreshold) {
  const auto all = encoder_.encode(parseBaseline("nvdb-fp8-zip")).bytes;
  const auto some = encoder_.encode(parseBaseline("nvdb-fp8-zip,threshold=0.5")).bytes;
  EXPECT_LT(some, all);
  EXPECT_LT(activeVoxelCount(encoder_.decode()), activeVoxelCount(grid_.volume));
}

TEST_F(Encoder, keepsZfpWithinItsAccuracy) {
  if (zfpVersion().empty()) GTEST_SKIP() << "built without ZFP";
  encoder_.encode(parseBaseline("zfp,accuracy=0.0625"));
  EXPECT_GT(encoder_.secondsToDecode(), 0.0);
  EXPECT_LE(compareVolumes(grid_.volume, encoder_.decode()).maxError, 0.0625);
  encoder_.encode(parseBaseline("zfp-bricks,accuracy=0.0625"));
  EXPECT_GT(encoder_.secondsToDecode(), 0.0);
  EXPECT_LE(compareVolumes(grid_.volume, encoder_.decode()).maxError, 0.0625);
  const auto fine = encoder_.encode(parseBaseline("zfp,precision=30"));
  EXPECT_LT(compareVolumes(grid_.volume, encoder_.decode()).maxError, 1e-6);
  EXPECT_GT(fine.bytes, encoder_.encode(parseBaseline("zfp,precision=4")).bytes);
}

TEST_F(Encoder, saysWhatItCannotDo) {
  if (!zfpVersion().empty()) {
    EXPECT_THROW(encoder_.encode(parseBaseline("zfp,precision=33")), UsageError);
    BaselineEncoder bounded({.grid = grid_,
                             .box = activeBox(grid_.volume),
                             .folder = folder_.path(),
                             .maxDenseBytes = 1000});
    EXPECT_THROW(bounded.encode(parseBaseline("zfp,precision=3")), UsageError);
  } else {
    EXPECT_THROW(encoder_.encode(parseBaseline("zfp,precision=3")), UsageError);
  }
  VolumeGrid large = ballGrid();
  for (float& value : large.volume.values) value *= 1e6f;
  BaselineEncoder encoder(
      {.grid = large, .box = activeBox(large.volume), .folder = folder_.path()});
  EXPECT_THROW(encoder.encode(parseBaseline("vdb-half-blosc")), UsageError);
}

// Searches.

class Matching : public testing::Test {
 protected:
  VolumeGrid grid_ = ballGrid();
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

namespace esvr::baselines {
namespace {

constexpr Box kBox{{-5, 3, 6}, {12, 9, 20}};  // cuts bricks on all sides

TEST(DenseBox, hasXFastest) {
  const auto volume = test::volumeOf({{{-4, 3, 6}, 1.0f}, {{-5, 4, 6}, 2.0f}, {{-5, 3, 7}, 3.0f}});
  const DenseBox dense = densify(volume, kBox, 0);
  ASSERT_EQ(dense.values.size(), 18u * 7 * 15);
  EXPECT_EQ(dense.values[1], 1.0f);
  EXPECT_EQ(dense.values[18], 2.0f);
  EXPECT_EQ(dense.values[18 * 7], 3.0f);
}

TEST(DenseBox, comesBackAsItWas) {
  const auto volume = test::randomVolume({.seed = 3, .brickShare = 0.5, .background = 0.25f});
  const SparseVolume back = sparsify(densify(volume, kBox, 0), 0.25f, 0.0f);
  for (int x = kBox.min.x; x <= kBox.max.x; ++x)
    for (int y = kBox.min.y; y <= kBox.max.y; ++y)
      for (int z = kBox.min.z; z <= kBox.max.z; ++z)
        ASSERT_EQ(valueAt(back, {x, y, z}), valueAt(volume, {x, y, z}));
  EXPECT_EQ(valueAt(back, {kBox.max.x + 1, 5, 8}), 0.25f) << "nothing beyond the box";
  EXPECT_NO_THROW(checkInvariants(back));
}

TEST(DenseBox, makesVoxelsActiveBeyondAThreshold) {
  DenseBox dense{kBox, std::vector<float>(18 * 7 * 15, 0.0f)};
  dense.values[0] = 0.1f;
  dense.values[1] = -0.3f;
  const SparseVolume back = sparsify(dense, 0.0f, 0.2f);
  EXPECT_EQ(activeVoxelCount(back), 1u);
  EXPECT_EQ(valueAt(back, kBox.min), 0.1f) << "inactive voxels keep their values";
}

TEST(DenseBox, isRefusedBeyondItsBound) {
  const auto volume = test::volumeOf({{{0, 3, 6}, 1.0f}});
  EXPECT_NO_THROW((void)densify(volume, kBox, 18 * 7 * 15 * 4));
  EXPECT_THROW((void)densify(volume, kBox, 18 * 7 * 15 * 4 - 1), UsageError);
}

TEST(ActivityThreshold, isHalfTheSmallestDifference) {
  EXPECT_EQ(activityThreshold(test::volumeOf({{{0, 0, 0}, 0.5f}, {{1, 0, 0}, -0.25f}})), 0.125f);
  EXPECT_EQ(activityThreshold(test::volumeOf({{{0, 0, 0}, 0.0f}})), 0.0f);
}

TEST(BrickStack, comesBackAsItWas) {
  const auto volume = test::randomVolume({.seed = 4, .brickShare = 0.4, .background = 0.25f});
  const SparseVolume stack = stackBricks(volume);
  EXPECT_NO_THROW(checkInvariants(stack));
  const SparseVolume back = unstackBricks(stack, volume.bricks, volume.origin);
  EXPECT_EQ(back.origin, volume.origin);
  EXPECT_EQ(back.bricks, volume.bricks);
  EXPECT_EQ(back.values, volume.values);
}

TEST(BrickStack, hasRowsThatZfpAllows) {
  for (const std::size_t bricks : {1, 8192, 8193, 1'000'000}) {
    const StackShape shape = stackShape(bricks);
    EXPECT_LE(shape.box().max.z, 65535);
    EXPECT_GE(shape.rows * shape.length, bricks);
    EXPECT_LT(shape.rows * shape.length, bricks + shape.rows) << "less than a brick in each row";
  }
  std::vector<BrickInput> many(8193);
  for (int b = 0; b < 8193; ++b) {
    many[b] = {.corner = {0, 8 * b, 0}, .values = {float(b)}, .active = {}};
    many[b].active.set(0);
  }
  const SparseVolume volume = makeVolume(std::move(many), 0.0f);
  const SparseVolume stack = stackBricks(volume);
  EXPECT_EQ(activeBox(stack).max.y, kBrickSide) << "two rows";
  EXPECT_EQ(unstackBricks(stack, volume.bricks, volume.origin).bricks, volume.bricks);
}

TEST(BrickStack, mayLackBricks) {
  const auto volume = test::volumeOf({{{0, 0, 0}, 1.0f}, {{8, 0, 0}, 2.0f}, {{24, 0, 0}, 3.0f}});
  SparseVolume stack = stackBricks(volume);
  stack.bricks.erase(stack.bricks.begin() + 1);
  stack.active.erase(stack.active.begin() + 1);
  stack.values.erase(stack.values.begin() + kBrickVoxels, stack.values.begin() + 2 * kBrickVoxels);
  const SparseVolume back = unstackBricks(stack, volume.bricks, volume.origin);
  EXPECT_EQ(valueAt(back, {24, 0, 0}), 3.0f);
  EXPECT_EQ(valueAt(back, {8, 0, 0}), 0.0f);
}

TEST(BrickPositions, comeBackAndTakeAByteInAColumn) {
  const std::vector<Coord> bricks{{0, 0, 0}, {0, 0, 1}, {0, 0, 300}, {0, 7, 2}, {5, 0, 1 << 28}};
  const auto bytes = encodeBricks(bricks);
  std::span<const std::byte> rest = bytes;
  EXPECT_EQ(decodeBricks(rest), bricks);
  EXPECT_TRUE(rest.empty());
  EXPECT_EQ(encodeBricks(std::span(bricks).first(2)).size(), 3u) << "the number and two gaps";
}

TEST(BrickPositions, areRefusedIfTheyEndTooEarly) {
  const auto bytes = encodeBricks(std::vector<Coord>{{0, 0, 0}, {3, 1, 2}});
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    std::span<const std::byte> some = std::span(bytes).first(n);
    EXPECT_THROW((void)decodeBricks(some), BadInput) << n;
  }
}

VolumeGrid gridOf(const std::vector<test::Voxel>& voxels, float background,
                  GridClass gridClass = GridClass::kFogVolume) {
  VolumeGrid grid;
  grid.descriptor.gridClass = gridClass;
  grid.descriptor.background = background;
  grid.volume = test::volumeOf(voxels, background);
  return grid;
}

TEST(Thresholds, areTheDistinctDeviationsInOrder) {
  const auto grid = gridOf({{{0, 0, 0}, 1.0f}, {{1, 0, 0}, 0.25f}, {{2, 0, 0}, 1.0f}}, 0.5f);
  EXPECT_THAT(thresholds(grid), testing::ElementsAre(0.25f, 0.5f));
}

TEST(WithoutVoxels, dropsThoseNearTheBackground) {
  const auto grid = gridOf({{{0, 0, 0}, 0.6f}, {{1, 0, 0}, 0.4f}, {{2, 0, 0}, 1.0f}}, 0.5f);
  const auto left = withoutVoxels(grid, 0.2).volume;
  EXPECT_EQ(activeVoxelCount(left), 1u);
  EXPECT_EQ(valueAt(left, {0, 0, 0}), 0.5f);
  EXPECT_EQ(valueAt(left, {2, 0, 0}), 1.0f);
}

TEST(WithoutVoxels, dropsBricksThatAreLeftEmpty) {
  const auto grid = gridOf({{{0, 0, 0}, 0.125f}, {{50, 0, 0}, 1.0f}}, 0.0f);
  const auto left = withoutVoxels(grid, 0.125).volume;
  ASSERT_EQ(left.brickCount(), 1u);
  EXPECT_EQ(left.brickCorner(0), (Coord{48, 0, 0}));
}

TEST(WithoutVoxels, narrowsALevelSetsBandAndKeepsSigns) {
  const auto grid = gridOf({{{0, 0, 0}, -2.75f}, {{1, 0, 0}, 0.5f}, {{2, 0, 0}, 2.75f}}, 3.0f,
                           GridClass::kLevelSet);
  const auto left = withoutVoxels(grid, 0.25).volume;
  EXPECT_EQ(activeVoxelCount(left), 1u);
  EXPECT_EQ(valueAt(left, {0, 0, 0}), -3.0f);
  EXPECT_EQ(valueAt(left, {1, 0, 0}), 0.5f);
  EXPECT_EQ(valueAt(left, {2, 0, 0}), 3.0f);
}

}  // namespace
}  // namespace esvr::baselines
