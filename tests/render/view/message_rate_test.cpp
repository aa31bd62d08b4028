// Plan: events at given times have to wait as long as the rate says, which is computed by hand.

#include "render/view/message_rate.h"

#include <gtest/gtest.h>

namespace esvr::view {
namespace {

using namespace std::chrono_literals;

TEST(MessageRateTest, LetsABurstPassAndThenKeepsToTheRate) {
  MessageRate rate(100.0, 3.0);
  const MessageRate::Clock::time_point start{};
  for (int i = 0; i < 3; ++i) EXPECT_EQ(rate.count(start), 0ms);
  EXPECT_EQ(rate.count(start), 10ms);
  EXPECT_EQ(rate.count(start), 20ms);
  EXPECT_EQ(rate.count(start + 30ms), 0ms);
}

TEST(MessageRateTest, SavesNoMoreThanABurst) {
  MessageRate rate(100.0, 2.0);
  const MessageRate::Clock::time_point start{};
  EXPECT_EQ(rate.count(start), 0ms);
  const auto later = start + 24h;
  EXPECT_EQ(rate.count(later), 0ms);
  EXPECT_EQ(rate.count(later), 0ms);
  EXPECT_EQ(rate.count(later), 10ms);
}

}  // namespace
}  // namespace esvr::view
