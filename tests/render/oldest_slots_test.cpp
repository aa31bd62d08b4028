// Plan: slots are chosen in the order of their last reading, and only those that have an owner.
#include "render/oldest_slots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace esvr::test {
namespace {

using testing::IsEmpty;
using testing::UnorderedElementsAre;

const std::vector<std::uint32_t> kOwners{10, 11, kNoOwner, 12}, kStamps{5, 2, 0, 9};

TEST(OldestSlots, AreThoseThatWereNotReadForTheLongestTime) {
  EXPECT_THAT(oldestSlots(1, kOwners, kStamps), UnorderedElementsAre(1u));
  EXPECT_THAT(oldestSlots(2, kOwners, kStamps), UnorderedElementsAre(0u, 1u));
}

TEST(OldestSlots, AreNoMoreThanThereAre) {
  EXPECT_THAT(oldestSlots(9, kOwners, kStamps), UnorderedElementsAre(0u, 1u, 3u));
  EXPECT_THAT(oldestSlots(3, {}, {}), IsEmpty());
}

}  // namespace
}  // namespace esvr::test
