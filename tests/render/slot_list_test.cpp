// Plan: slots are given to bricks, taken back, and freed in the order of their last reading. A slot
// has one owner at a time, and the bricks that lose theirs are reported.
#include "render/slot_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

TEST(SlotList, GivesEachSlotOnce) {
  SlotList list;
  EXPECT_EQ(list.freeCount(), 0u);
  list.grow(3);
  std::set<std::uint32_t> slots;
  for (std::uint32_t brick = 10; brick < 13; ++brick) slots.insert(list.take(brick));
  EXPECT_EQ(slots, (std::set<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(list.freeCount(), 0u);
  list.grow(2);
  EXPECT_EQ(list.size(), 5u);
  EXPECT_THAT((std::array{list.take(13), list.take(14)}), UnorderedElementsAre(3u, 4u));
}

TEST(SlotList, GivesASlotAgainThatCameBack) {
  SlotList list;
  list.grow(1);
  const std::uint32_t slot = list.take(7);
  list.giveBack(slot);
  EXPECT_EQ(list.take(8), slot);
  EXPECT_THAT(list.evict(1, std::vector<std::uint32_t>{0}), ElementsAre(8u));
}

TEST(SlotList, FreesThoseThatWereNotReadForTheLongestTime) {
  SlotList list;
  list.grow(4);
  std::vector<std::uint32_t> stamps(4);
  const std::uint32_t times[] = {5, 2, 9};
  for (std::uint32_t brick = 0; brick < 3; ++brick) stamps[list.take(brick)] = times[brick];
  EXPECT_THAT(list.evict(2, stamps), UnorderedElementsAre(0u, 1u));
  EXPECT_EQ(list.freeCount(), 3u);
}

TEST(SlotList, FreesNoMoreThanThereAre) {
  SlotList list;
  list.grow(3);
  (void)list.take(4);
  EXPECT_THAT(list.evict(3, std::vector<std::uint32_t>(3)), ElementsAre(4u));
  EXPECT_THAT(list.evict(3, std::vector<std::uint32_t>(3)), IsEmpty());
  EXPECT_EQ(list.freeCount(), 3u);
}

}  // namespace
}  // namespace esvr::test
