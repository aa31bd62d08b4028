// Plan: a token for a part of a call is cancelled with the whole call, but not the other way round.

#include <gtest/gtest.h>

#include "esvr/progress.h"

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

}  // namespace
}  // namespace esvr
