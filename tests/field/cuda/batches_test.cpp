#include "field/cuda/batches.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

namespace esvr::cuda {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr BrickCost kCost{.perBrick = 10, .perPair = 1};
// Bricks of 0, 5, 0, 100 and 1 pairs: 10, 15, 10, 110 and 11 bytes.
constexpr std::array<std::uint32_t, 6> kBegin{0, 0, 5, 5, 105, 106};

TEST(SplitIntoBatches, TakesAllThatFits) {
  EXPECT_THAT(splitIntoBatches(kBegin, kCost, 156), ElementsAre(Batch{0, 5}));
}

TEST(SplitIntoBatches, BeginsANewBatchWhereTheBoundWouldBePassed) {
  EXPECT_THAT(splitIntoBatches(kBegin, kCost, 155), ElementsAre(Batch{0, 4}, Batch{4, 5}));
  EXPECT_THAT(splitIntoBatches(kBegin, kCost, 121), ElementsAre(Batch{0, 3}, Batch{3, 5}));
  EXPECT_THAT(splitIntoBatches(kBegin, kCost, 120),
              ElementsAre(Batch{0, 3}, Batch{3, 4}, Batch{4, 5}));
}

TEST(SplitIntoBatches, LeavesABrickThatExceedsTheBoundAlone) {
  EXPECT_THAT(splitIntoBatches(kBegin, kCost, 25),
              ElementsAre(Batch{0, 2}, Batch{2, 3}, Batch{3, 4}, Batch{4, 5}));
  EXPECT_EQ(splitIntoBatches(kBegin, kCost, 0).size(), 5u);
}

TEST(SplitIntoBatches, GivesNoneForNoBricks) {
  EXPECT_THAT(splitIntoBatches(std::array{0u}, kCost, 100), IsEmpty());
}

}  // namespace
}  // namespace esvr::cuda
