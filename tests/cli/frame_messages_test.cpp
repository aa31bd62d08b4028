#include "cli/frame_messages.h"

#include <gtest/gtest.h>

namespace esvr::cli {
namespace {

TEST(FrameMessages, NameTheFrames) {
  EXPECT_EQ(textOf(Frame{.number = -7}), "frame -7");
  EXPECT_EQ(sentenceOn({1, 2, 3, 9}, 100, "failed"), "4 of 100 frames failed: 1-3, 9");
}

TEST(FrameMessages, KeepTheKindOfTheFailureOfAHeldFrame) {
  const Error error = failureToHold(Frame{.number = 7}, BadInput("damaged"));
  EXPECT_EQ(error.kind(), ErrorKind::kBadInput);
  EXPECT_STREQ(error.what(), "frame 7, which it holds, failed");
}

}  // namespace
}  // namespace esvr::cli
