// Plan: the search for voxels reaches its goal, and tells what it expects from a sample of a larger
// volume. A sample has bricks of its volume with their values, about as many as wanted, from all over the
// coding order. A lattice contains the value of a plateau where that pays.

#include "encode/voxels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "encode/volumes.h"
#include "esvr/encode.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

class VoxelSearch : public testing::Test {
 protected:
  [[nodiscard]] encode::VoxelCandidate forPsnr(double psnr) const {
    return *encode::VoxelSearch(job_, {.psnr = psnr}).run();
  }
  [[nodiscard]] std::optional<encode::VoxelCandidate> ofBytes(std::uint64_t bytes) const {
    return encode::VoxelSearch(job_, {.bytes = bytes}).run();
  }

  GridDescriptor descriptor_;
  SparseVolume volume_ = test::smoothVolume();
  ConvertInput input_{descriptor_, volume_};
  ConvertOptions options_;
  encode::Job job_{input_, options_};
};

TEST_F(VoxelSearch, SlowReachesAPsnrAndLittleMore) {
  for (const double psnr : {20.0, 40.0, 60.0}) {
    const auto found = forPsnr(psnr);
    EXPECT_GE(found.psnr, psnr);
    EXPECT_LT(found.psnr, psnr + 0.5);
    EXPECT_EQ(found.psnr, compareVolumes(volume_, decodeGrid(found.grid)).psnrBox);
    EXPECT_EQ(found.bytes, bytesAdded(found.grid));
  }
}

TEST_F(VoxelSearch, EndsWhereARivalTakesFarFewerBytes) {
  const auto wanted = forPsnr(40.0);
  const double bytes = double(wanted.bytes);
  encode::VoxelSearch far(job_, {.psnr = 40.0});
  const auto least = far.estimate(0.2 * bytes);
  ASSERT_TRUE(least);
  EXPECT_TRUE(least->estimated);
  EXPECT_GT(double(least->bytes), 0.6 * bytes);
  EXPECT_LE(double(least->bytes), bytes);
  EXPECT_EQ(far.run()->grid.voxels, wanted.grid.voxels) << "it searches on when it has to";
  encode::VoxelSearch near(job_, {.psnr = 40.0});
  EXPECT_FALSE(near.estimate(0.5 * bytes)->estimated) << "a rival that is not far ahead";
}

TEST_F(VoxelSearch, FillsASize) {
  for (const std::uint64_t bytes : {4000u, 20000u}) {
    const auto found = ofBytes(bytes);
    ASSERT_TRUE(found);
    EXPECT_LE(found->bytes, bytes);
    EXPECT_GE(double(found->bytes), 0.98 * double(bytes));
  }
}

TEST_F(VoxelSearch, SaysWhichPsnrIsOutOfReachOfASize) {
  const std::uint64_t bytes = 4000;
  const double best = ofBytes(bytes)->psnr;
  encode::VoxelSearch search(job_, {.bytes = bytes});
  EXPECT_FALSE(search.tooLargeFor(best - 1.0));
  const auto tooLarge = search.tooLargeFor(best + 6.0);
  ASSERT_TRUE(tooLarge);
  EXPECT_GT(tooLarge->bytes, bytes);
  EXPECT_GE(*tooLarge->psnr, best + 6.0);
  EXPECT_TRUE(tooLarge->estimated);
}

TEST_F(VoxelSearch, TakesExactVoxelsOfASizeOnlyIfTheyKeepToIt) {
  const std::uint64_t bytes = encode::exactVoxels(job_).bytes;
  const auto exact = ofBytes(bytes + 16);
  ASSERT_TRUE(exact);
  EXPECT_EQ(exact->bytes, bytes);
  EXPECT_EQ(decodeGrid(exact->grid).values, volume_.values);
  EXPECT_TRUE(std::isfinite(ofBytes(bytes / 2)->psnr));
}

TEST_F(VoxelSearch, FindsExactVoxelsWhereNothingElseReachesAPsnr) {
  const auto found = forPsnr(250.0);
  EXPECT_TRUE(std::isinf(found.psnr));
  EXPECT_EQ(decodeGrid(found.grid).values, volume_.values);
}

TEST_F(VoxelSearch, TakesExactVoxelsOfDoublesAsTheyWereRead) {
  descriptor_.valueType = ValueType::kDouble;
  EXPECT_EQ(decodeGrid(forPsnr(250.0).grid).values, volume_.values);
}

TEST_F(VoxelSearch, StoresAHandfulOfValuesExactly) {
  // Three steps of a staircase: quantised voxels of 40 dB would take about as many bytes.
  volume_ = test::volumeOf({}, 4, 0.0f, [](Coord v) { return 0.21f + 0.37f * float(v.x / 11); });
  const auto found = forPsnr(40.0);
  EXPECT_EQ(found.bytes, encode::exactVoxels(job_).bytes);
  EXPECT_TRUE(std::isinf(found.psnr));
  EXPECT_EQ(decodeGrid(found.grid).values, volume_.values);
}

TEST_F(VoxelSearch, TakesExactVoxelsThatTakeLittleMoreThanTheirMask) {
  options_.storage.activity = Activity::kExact;
  test::Random random(11);
  volume_ =
      test::volumeOf({}, 3, 0.0f, [&](Coord) { return random(0.0, 1.0) < 0.4 ? 0.7f : 0.0f; });
  EXPECT_EQ(decodeGrid(forPsnr(30.0).grid).values, volume_.values);
  volume_ =
      test::volumeOf({}, 3, 0.0f, [&](Coord) { return float(int(random(1.0, 200.0))) / 200.0f; });
  EXPECT_NE(decodeGrid(forPsnr(30.0).grid).values, volume_.values) << "many values take more";
}

TEST_F(VoxelSearch, PutsAPlateauOnTheLattice) {
  test::Random random(11);
  volume_ = test::volumeOf({}, 3, 0.0f,
                           [&](Coord v) { return v.x < 12 ? 0.731f : float(random(0.1, 0.7)); });
  const auto found = forPsnr(30.0);
  const SparseVolume back = decodeGrid(found.grid);
  for (std::size_t i = 0; i < volume_.values.size(); ++i) {
    if (volume_.values[i] != 0.731f) continue;
    ASSERT_NEAR(back.values[i], 0.731f, 1e-5f);
  }
}

TEST_F(VoxelSearch, StoresOneValueInFewBytes) {
  volume_ = test::volumeOf({}, 4, 0.0f, [](Coord) { return 0.5f; });
  const auto found = forPsnr(40.0);
  EXPECT_EQ(decodeGrid(found.grid).values, volume_.values);
  EXPECT_LT(found.bytes, 1000u);
}

// A sample of a tenth of the bricks.
TEST_F(VoxelSearch, SlowKnowsFromASampleWhatALargeVolumeTakes) {
  test::Random random(7);
  volume_ = test::volumeOf({}, 10, 0.0f, [&](Coord v) {
    return float(std::sin(0.11 * v.x) * std::cos(0.07 * v.y) + 0.02 * random(0.0, 1.0));
  });
  encode::VoxelSearch psnr(job_, {.psnr = 45.0}, 192);
  const Candidate expected = *psnr.estimate();
  EXPECT_TRUE(expected.estimated);
  const auto found = psnr.run();
  EXPECT_GE(found->psnr, 45.0);
  EXPECT_LT(found->psnr, 45.5);
  EXPECT_EQ(found->psnr, psnrOverBox(volume_, decodeGrid(found->grid)));
  const double margin = encode::kEstimateMargin;
  EXPECT_LT(double(expected.bytes), margin * double(found->bytes));
  EXPECT_GT(double(expected.bytes) * margin, double(found->bytes));
  encode::VoxelSearch size(job_, {.bytes = found->bytes}, 192);
  EXPECT_NEAR(*size.estimate()->psnr, found->psnr, 3.0);
  EXPECT_LE(size.run()->bytes, found->bytes);
}

// ---- Samples

TEST(Sample, HasBricksOfTheVolumeAtTheirPositions) {
  const SparseVolume volume = test::noiseVolume(6);
  const SparseVolume sample = encode::sampleOf(volume, 128);
  checkInvariants(sample);
  EXPECT_EQ(sample.brickCount(), 128u);
  EXPECT_EQ(sample.background, volume.background);
  for (std::size_t b = 0; b < sample.brickCount(); ++b) {
    const auto at = findBrick(volume, sample.bricks[b]);
    ASSERT_TRUE(at);
    EXPECT_EQ(sample.brickCorner(b), volume.brickCorner(*at));
    EXPECT_EQ(sample.active[b], volume.active[*at]);
    EXPECT_TRUE(std::ranges::equal(sample.brickValues(b), volume.brickValues(*at)));
  }
}

TEST(Sample, ReachesFromTheFirstToTheLastBrick) {
  const SparseVolume volume = test::noiseVolume(8);
  const SparseVolume sample = encode::sampleOf(volume, 128);
  EXPECT_EQ(sample.bricks.front(), volume.bricks.front());
  EXPECT_EQ(sample.bricks.back(), volume.bricks.back());
}

TEST(Sample, OfASmallVolumeIsTheVolume) {
  const SparseVolume volume = test::noiseVolume(2);
  EXPECT_EQ(encode::sampleOf(volume, 8).values, volume.values);
}

TEST(ExactVoxels, SlowHaveAnEstimateNearTheirBytes) {
  const SparseVolume volume = test::noiseVolume(21);
  const GridDescriptor descriptor;
  const ConvertInput input{descriptor, volume};
  const ConvertOptions options;
  const encode::Job job{input, options};
  const Candidate estimate = encode::estimateExactVoxels(job);
  const double bytes = double(encode::exactVoxels(job).bytes);
  EXPECT_NEAR(double(estimate.bytes), bytes, 0.1 * bytes);
  EXPECT_TRUE(estimate.estimated);
  EXPECT_TRUE(std::isinf(*estimate.psnr));
}

TEST(ExactVoxels, AreMentionedWhereEllipsoidsThatWereInsistedOnTakeMore) {
  const SparseVolume volume = test::noiseVolume(2);
  const auto smaller = [&](std::size_t count) {
    ConvertOptions options;
    options.goal = FitGoal{};
    options.fit.count = count;
    options.fit.iterations = 20;
    options.storage.form = Storage::kFloat32;
    return convertVolume({{}, volume}, options).smallerExactBytes;
  };
  EXPECT_FALSE(smaller(20));
  ASSERT_TRUE(smaller(1500));
  EXPECT_LT(*smaller(1500), 1500u * 34u);
}

}  // namespace
}  // namespace esvr
