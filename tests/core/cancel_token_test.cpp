// Plan: a token for a part of a call is cancelled with the whole call, but not the other way round. A
// scope gives a thread its token and the tasks of a loop that of the thread that began it, and ends these
// loops. In a completion, loops are not cancelled.

#include "esvr/device.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>

#include "core/parallel.h"
#include "esvr/error.h"

namespace esvr {
namespace {

TEST(CancelToken, OfAPartIsCancelledWithTheWhole) {
  CancelToken whole;
  const CancelToken part(&whole);
  EXPECT_FALSE(part.cancelled());
  whole.cancel();
  EXPECT_TRUE(part.cancelled());
}

TEST(CancelToken, OfAPartDoesNotCancelTheWhole) {
  CancelToken whole;
  CancelToken part(&whole);
  part.cancel();
  EXPECT_TRUE(part.cancelled());
  EXPECT_FALSE(whole.cancelled());
}

TEST(CancelToken, OfAPartNeedsNoWhole) {
  CancelToken part(nullptr);
  EXPECT_FALSE(part.cancelled());
  part.cancel();
  EXPECT_TRUE(part.cancelled());
}

TEST(CancelScope, IsThatOfItsThreadUntilItEnds) {
  CancelToken outer, inner;
  EXPECT_EQ(CancelScope::token(), nullptr);
  {
    const CancelScope first(&outer);
    EXPECT_EQ(CancelScope::token(), &outer);
    EXPECT_EQ(CancelScope::orToken(nullptr), &outer);
    EXPECT_EQ(CancelScope::orToken(&inner), &inner);
    {
      const CancelScope second(&inner);
      inner.cancel();
      EXPECT_THROW(CancelScope::check(), Cancelled);
      std::thread([] { EXPECT_EQ(CancelScope::token(), nullptr); }).join();
    }
    EXPECT_NO_THROW(CancelScope::check());
  }
  EXPECT_EQ(CancelScope::token(), nullptr);
}

TEST(CancelScope, IsThatOfAllTasksOfALoop) {
  CancelToken token;
  const CancelScope scope(&token);
  std::atomic<int> done = 0;
  const auto count = [&](int i) {
    EXPECT_EQ(CancelScope::token(), &token);
    if (++done == 10) token.cancel();
    parallelFor(0, 2, [&](int) { EXPECT_EQ(CancelScope::token(), &token); });
    (void)i;
  };
  EXPECT_THROW(parallelFor(0, 1'000'000, count), Cancelled);
  EXPECT_LT(done, 1000);
}

TEST(CancelScope, EndsReductionsAndInvocations) {
  CancelToken token;
  token.cancel();
  const CancelScope scope(&token);
  const tbb::blocked_range<int> range(0, 100);
  const auto same = [](const tbb::blocked_range<int>&, int value) { return value; };
  EXPECT_THROW((void)parallelReduce(range, 0, same, std::plus<>()), Cancelled);
  EXPECT_THROW((void)parallelDeterministicReduce(range, 0, same, std::plus<>()), Cancelled);
  EXPECT_THROW(parallelInvoke([] { throwIfCancelled(); }, [] { throwIfCancelled(); }), Cancelled);
}

TEST(Completion, LetsLoopsEndAndIsKnownToTheWholeCall) {
  CancelToken whole;
  CancelToken part(&whole);
  part.cancel();
  const CancelScope scope(&part);
  {
    const Completion completion;
    EXPECT_TRUE(part.completing());
    EXPECT_TRUE(whole.completing());
    std::atomic<int> done = 0;
    parallelFor(0, 1000, [&](int) { ++done; });
    EXPECT_EQ(done, 1000);
  }
  EXPECT_FALSE(whole.completing());
  {
    const BestSoFar wanted;
    EXPECT_NO_THROW(CancelScope::check());
  }
  whole.discardResults();
  const BestSoFar unwanted;
  EXPECT_FALSE(whole.completing());
  EXPECT_THROW(CancelScope::check(), Cancelled);
}

}  // namespace
}  // namespace esvr
