// Plan: blobs move from frame to frame. The second frame continues the ellipsoids of the first one,
// reaches its PSNR and takes a part of the bytes. A reader gets the same grid. A frame that has
// nothing in common with the previous one is fitted anew. The bytes do not depend on threads.

#include "convert/continued_search.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "convert/volumes.h"
#include "esvr/frame_coding.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

constexpr double kFramePsnr = 40.0;
const GridDescriptor kFrameDescriptor;

/// Forty blobs that have moved by a shear and a translation.
SparseVolume movedFrame(double time) {
  test::Random random(11);
  std::array<std::array<double, 4>, 40> blobs;
  for (auto& [x, y, z, width] : blobs) {
    x = random(8, 40), y = random(8, 40), z = random(8, 40), width = random(2, 4);
    x += time * (1.5 + 0.02 * y), y += 0.8 * time;
  }
  return test::volumeOf({}, 6, 0.0f, [&](Coord v) {
    double sum = 0.0;
    for (const auto& [x, y, z, width] : blobs)
      sum += std::exp(-((v.x - x) * (v.x - x) + (v.y - y) * (v.y - y) + (v.z - z) * (v.z - z)) /
                      (2.0 * width * width));
    return float(sum);
  });
}

ConvertOptions frameOptions(const Goal& goal) {
  ConvertOptions options;
  options.goal = goal;
  options.representation = Representation::kEllipsoids;
  options.fit.iterations = 200;
  return options;
}

StoredGrid convertedFrame(const SparseVolume& volume, const StoredGrid* previous,
                          const Goal& goal = PsnrGoal{kFramePsnr}) {
  ConvertOptions options = frameOptions(goal);
  options.previous = previous;
  return convertVolume({kFrameDescriptor, volume}, options).grid;
}

bool continuesFrame(const StoredGrid& grid) {
  return grid.quantised.size() == 1 && !grid.quantised[0].continues.empty();
}

class Continued : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    first_ = std::make_unique<StoredGrid>(convertedFrame(movedFrame(0.0), nullptr));
  }
  static void TearDownTestSuite() { first_.reset(); }
  static inline std::unique_ptr<StoredGrid> first_;
};

TEST_F(Continued, FrameReachesItsPsnrWithFewerBytes) {
  const SparseVolume volume = movedFrame(1.0);
  const StoredGrid grid = convertedFrame(volume, first_.get());
  ASSERT_TRUE(continuesFrame(grid));
  EXPECT_GE(psnrOverBox(volume, decodeGrid(grid)), kFramePsnr);
  EXPECT_LT(double(bytesInFrame(grid, first_.get())), 0.7 * double(bytesAdded(grid)));
  EXPECT_GT(double(grid.quantised[0].continues.size()), 0.8 * double(grid.quantised[0].size()));
}

TEST_F(Continued, SlowFramesFollowEachOther) {
  StoredGrid previous = *first_;
  for (int frame = 1; frame <= 3; ++frame) {
    const SparseVolume volume = movedFrame(frame);
    StoredGrid grid = convertedFrame(volume, &previous);
    EXPECT_TRUE(continuesFrame(grid)) << frame;
    EXPECT_GE(psnrOverBox(volume, decodeGrid(grid)), kFramePsnr) << frame;
    previous = std::move(grid);
  }
}

TEST_F(Continued, SlowMotionsOfTheEllipsoidsAreThoseOfTheBlobs) {
  const StoredGrid grid = convertedFrame(movedFrame(1.0), first_.get());
  ASSERT_TRUE(continuesFrame(grid));
  std::vector<std::int32_t> along = grid.quantised[0].motion[0];
  // The median, since an ellipsoid may be moved to another place by the fit.
  const auto middle = along.begin() + std::ptrdiff_t(along.size() / 2);
  std::nth_element(along.begin(), middle, along.end());
  // Blobs move by 1.5 to 2.3 voxels along x.
  EXPECT_NEAR(*middle / 256.0, 1.9, 0.4);
}

TEST_F(Continued, SlowPresetsContinueToo) {
  EXPECT_TRUE(continuesFrame(convertedFrame(movedFrame(0.5), first_.get(), PresetGoal{})));
}

TEST_F(Continued, SlowOtherGoalsDoNot) {
  EXPECT_FALSE(continuesFrame(convertedFrame(movedFrame(0.5), first_.get(), SizeGoal{900})));
}

TEST_F(Continued, SlowAFrameWithoutLikenessIsFittedAnew) {
  const SparseVolume other = test::tubeVolume();
  const StoredGrid grid = convertedFrame(other, first_.get(), PsnrGoal{30.0});
  EXPECT_GE(psnrOverBox(other, decodeGrid(grid)), 30.0);
  EXPECT_LE(bytesInFrame(grid, first_.get()), bytesAdded(grid));
}

TEST_F(Continued, SlowAFrameFarAwayIsFittedAnew) {
  SparseVolume far = movedFrame(0.0);
  far.origin = far.origin + Coord{1 << 20, 0, 0};
  const StoredGrid grid = convertedFrame(far, first_.get());
  EXPECT_FALSE(continuesFrame(grid));
  EXPECT_GE(psnrOverBox(far, decodeGrid(grid)), kFramePsnr);
}

TEST_F(Continued, SlowBytesDoNotDependOnThreads) {
  const auto bytes = [&] {
    const EsvrFile file{{}, {convertedFrame(movedFrame(1.0), first_.get())}};
    const EsvrFile before{{}, {*first_}};
    return encodeFrame(file, &before);
  };
  const auto all = bytes();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(bytes(), all);
}

}  // namespace
}  // namespace esvr
