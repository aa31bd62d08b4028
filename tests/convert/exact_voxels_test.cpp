// Plan: the estimate from a sample is near the bytes of exact voxels. A limit of one voxel makes
// every volume a large one. For a fit, for a PSNR and for a size, one conversion must give exact
// voxels and one must give ellipsoids. If an option insists on ellipsoids that take more bytes than
// exact voxels, the conversion must say so.

#include "convert/exact_voxels.h"

#include <gtest/gtest.h>

#include <cmath>

#include "convert/choice.h"
#include "convert/volumes.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

using convert::Job;

class LargeVolume : public testing::Test {
 protected:
  void SetUp() override { options_.fit.iterations = 20; }

  [[nodiscard]] Job job() const { return {input_, options_, kLimits}; }
  [[nodiscard]] bool isExact(const Conversion& conversion) const {
    return decodeGrid(conversion.grid).values == volume_.values;
  }

  static constexpr convert::VoxelLimits kLimits{.maxVoxels = 1,
                                                .sample = {.bricks = 64, .runs = 8}};
  GridDescriptor descriptor_;
  SparseVolume volume_ = test::noiseVolume(6);
  ConvertInput input_{descriptor_, volume_};
  ConvertOptions options_;
};

TEST_F(LargeVolume, HasAnEstimateNearItsBytes) {
  const auto estimate = convert::estimateExactVoxels(input_, kLimits.sample);
  const double bytes = double(convert::exactVoxels(job()).bytes);
  EXPECT_NEAR(double(estimate.bytes), bytes, 0.1 * bytes);
  EXPECT_TRUE(estimate.estimated);
  EXPECT_TRUE(std::isinf(*estimate.psnr));
}

TEST_F(LargeVolume, IsCodedOnlyWhereItMayBeSmallEnough) {
  const Job large = job();
  convert::ExactVoxels exact(large);
  EXPECT_FALSE(exact.takeAtMost(1000.0));
  EXPECT_TRUE(exact.figures().estimated) << "not coded";
  EXPECT_TRUE(exact.takeAtMost(1e9));
  EXPECT_FALSE(exact.figures().estimated);
}

TEST_F(LargeVolume, FitIsReplacedByFewerBytesOfExactVoxels) {
  const auto fitted = [&](const Job& large) {
    return convert::unlessExactIsSmaller(large, [&] {
      ConvertOptions insisting = options_;
      insisting.goal = FitGoal{};
      insisting.representation = Representation::kEllipsoids;
      return convertVolume(input_, insisting);
    });
  };
  options_.fit.count = 40;
  const Conversion ellipsoids = fitted(job());
  EXPECT_FALSE(ellipsoids.grid.voxels);
  EXPECT_TRUE(ellipsoids.choice->voxels->estimated) << "noise takes many bytes";
  volume_ = test::volumeOf({}, 4, 0.0f, [](Coord) { return 0.5f; });
  EXPECT_TRUE(isExact(fitted(job())));
}

TEST_F(LargeVolume, ThatCannotHaveAPsnrWithFewerBytesIsExact) {
  const Conversion conversion = convert::convertToPsnr(job(), {90.0});
  EXPECT_TRUE(isExact(conversion));
  EXPECT_TRUE(conversion.choice->ellipsoids->estimated) << "only short fits were made";
}

TEST_F(LargeVolume, SlowHasEllipsoidsWhereTheseAreSmaller) {
  volume_ = test::smoothVolume();
  options_.fit.iterations = 200;
  const Conversion conversion = convert::convertToPsnr(job(), {35.0});
  EXPECT_GT(conversion.grid.field.ellipsoidCount(), 0u);
  EXPECT_TRUE(conversion.choice->voxels->estimated);
  EXPECT_GE(compareVolumes(volume_, decodeGrid(conversion.grid)).psnrBox, 35.0);
}

TEST_F(LargeVolume, IsExactWhereItFitsIntoASize) {
  EXPECT_TRUE(isExact(convert::convertToSize(job(), 10'000'000)));
  const Conversion small = convert::convertToSize(job(), 2000);
  EXPECT_FALSE(small.grid.voxels);
  EXPECT_LE(bytesAdded(small.grid), 2000u);
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
