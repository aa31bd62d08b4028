// Plan: all bricks that supports reach are found, also if so many are found at the same time that
// the first table is full before a thread notices it. They are numbered in order, and bricks
// outside a box are not searched. On the host, the tests check the sizes of tables and the clipping
// of ranges.

#include <algorithm>

#include "core/cuda/device_buffer.h"
#include "core/cuda/runtime.h"
#include "fit/cuda/gpu_test.h"
#include "fit/cuda/lists.h"

namespace esvr::cuda {
namespace {

TEST(TableSlots, AreAPowerOfTwoAndAtMostHalfUsed) {
  for (const std::size_t entries : {0, 1, 2, 1000, 4095, 4096, 1'000'000}) {
    const std::size_t slots = slotsFor(entries);
    EXPECT_EQ(slots & (slots - 1), 0u);
    EXPECT_GT(slots, 2 * entries);
    EXPECT_LE(slots, 4 * entries + 4);
  }
}

Ellipsoid sphereAt(Coord brick, double scale) {
  const double l = 1.0 / scale;
  return {{brick.x * 8.0 + 3.5, brick.y * 8.0 + 3.5, brick.z * 8.0 + 3.5},
          {l, 0, 0, 0, l, 0, 0, 0, l},
          1.0};
}

// Supports in the paper's method may cover half the volume. To visit all their bricks for a
// subvolume with few bricks would take longer than the fit.
TEST(ClippedRange, OfAHugeSupportIsTheBoxOfBricks) {
  const Ellipsoid p = sphereAt({0, 0, 0}, 1e5);
  const Support support = makeSupport(p.center, p.L, 2.0, 0.0);
  const Box within{{-2, 0, 5}, {3, 1, 9}};
  EXPECT_EQ(clippedRange(support, within), within);
  EXPECT_GT(clippedRange(support, kAllBricks).volume(), 1e13);
  const Ellipsoid far = sphereAt({100, 0, 0}, 1.0);
  EXPECT_TRUE(clippedRange(makeSupport(far.center, far.L, 2.0, 0.0), within).empty());
}

class BrickTableOnGpu : public test::CudaTest {
 protected:
  void find(BrickTable& table, const std::vector<Ellipsoid>& ellipsoids, const Box& within) {
    const DeviceBuffer<Ellipsoid> device(std::span<const Ellipsoid>(ellipsoids), stream_->get());
    table.findReached(sourceOf(device), within);
    stream_->synchronize();
  }
  static SupportSource sourceOf(const DeviceBuffer<Ellipsoid>& ellipsoids) {
    return {
        .ellipsoids = ellipsoids.data(), .count = ellipsoids.size(), .radius = 2.0, .slack = 0.0};
  }
  std::vector<Coord> bricksOf(const BrickTable& table) {
    std::vector<Coord> bricks(table.size());
    downloadTo(std::span<Coord>(bricks), table.view().bricks, stream_->get());
    return bricks;
  }
  void SetUp() override {
    CudaTest::SetUp();
    if (!IsSkipped()) stream_.emplace();
  }
  std::optional<Stream> stream_;
};

// 200,000 bricks are inserted into a table of 4096 slots. Without a limit on probes, a thread that
// finds every slot taken by other bricks would never end.
TEST_F(BrickTableOnGpu, FindsMoreBricksAtOnceThanTheFirstTableHolds) {
  std::vector<Ellipsoid> ellipsoids;
  std::vector<Coord> expected;
  for (int n = 0; n < 200'000; ++n) {
    expected.push_back({n / 2000 * 3, n / 50 % 40 * 3, n % 50 * 3});
    ellipsoids.push_back(sphereAt(expected.back(), 1.0));
  }
  std::sort(expected.begin(), expected.end());
  for (int run = 0; run < 3; ++run) {
    BrickTable table({}, stream_->get());
    find(table, ellipsoids, kAllBricks);
    EXPECT_EQ(bricksOf(table), expected);
  }
}

TEST_F(BrickTableOnGpu, FindsOnlyTheBricksOfABox) {
  const Box within{{-1, -1, -1}, {1, 2, 1}};
  const std::vector<Coord> targets{{0, 0, 0}, {1, 2, 1}};
  BrickTable table(targets, stream_->get());
  find(table, {sphereAt({0, 0, 0}, 1e5)}, within);
  const auto bricks = bricksOf(table);
  ASSERT_EQ(bricks.size(), 36u);
  EXPECT_EQ(std::vector<Coord>(bricks.begin(), bricks.begin() + 2), targets);
  EXPECT_TRUE(std::is_sorted(bricks.begin() + 2, bricks.end()));
  for (const Coord b : bricks) EXPECT_TRUE(within.contains(b));
}

// The walk over a support that reaches 10^14 bricks visits only existing bricks.
TEST_F(BrickTableOnGpu, AnEllipsoidOverEverythingIsPairedWithEveryBrickOnce) {
  std::vector<Coord> targets;
  for (int n = 0; n < 1000; ++n) targets.push_back({n % 10 * 5, n / 10 % 10 * 7, n / 100});
  std::sort(targets.begin(), targets.end());
  const BrickTable table(targets, stream_->get());
  const DeviceBuffer<Ellipsoid> ellipsoids(
      std::vector<Ellipsoid>{sphereAt({3, 3, 3}, 1e6), sphereAt(targets[17], 0.5)}, stream_->get());
  PairLists lists(stream_->get());
  lists.rebuild(sourceOf(ellipsoids), table);
  EXPECT_EQ(lists.pairCount(), 1001u);
}

}  // namespace
}  // namespace esvr::cuda
