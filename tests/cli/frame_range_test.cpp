// Plan: the documented examples of fileseq's grammar give the frames that fileseq documents. Texts
// that are not of the grammar are refused with a message that names the option.

#include "cli/frame_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

std::vector<FrameNumber> frames(const std::string& text) { return parseFrames("frames", text); }

TEST(FrameRange, IsOneFrameOrAllFromTheFirstToTheLast) {
  EXPECT_THAT(frames("10"), ElementsAre(10));
  EXPECT_THAT(frames("1-5"), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_THAT(frames("5-1"), ElementsAre(5, 4, 3, 2, 1));
  EXPECT_THAT(frames("0"), ElementsAre(0));
}

TEST(FrameRange, MayHaveSteps) {
  EXPECT_THAT(frames("1-10x5"), ElementsAre(1, 6));
  EXPECT_THAT(frames("1-10x2"), ElementsAre(1, 3, 5, 7, 9));
  EXPECT_THAT(frames("10-1x4"), ElementsAre(10, 6, 2));
  EXPECT_THAT(frames("1-10x100"), ElementsAre(1));
  EXPECT_THAT(frames("1-100x5"), SizeIs(20));
}

TEST(FrameRange, MayBeWhatAStepLeavesOut) {
  EXPECT_THAT(frames("1-10y2"), ElementsAre(2, 4, 6, 8, 10));
  EXPECT_THAT(frames("1-9y3"), ElementsAre(2, 3, 5, 6, 8, 9));
  EXPECT_THAT(frames("1-100y5"), SizeIs(80));
}

TEST(FrameRange, MayBeStaggered) {
  EXPECT_THAT(frames("1-10:3"), ElementsAre(1, 4, 7, 10, 3, 5, 9, 2, 6, 8));
  const auto eight = frames("1-100:8");
  EXPECT_THAT(eight, SizeIs(100));
  EXPECT_EQ(eight.front(), 1);
  EXPECT_EQ(eight.back(), 98);
}

TEST(FrameRange, MayBeNegative) {
  EXPECT_THAT(frames("-5--1"), ElementsAre(-5, -4, -3, -2, -1));
  EXPECT_THAT(frames("-1-1"), ElementsAre(-1, 0, 1));
  EXPECT_THAT(frames("1--1"), ElementsAre(1, 0, -1));
  EXPECT_THAT(frames("-10-100"), SizeIs(111));
  EXPECT_THAT(frames("-7"), ElementsAre(-7));
}

TEST(FrameRange, ListHasEveryFrameOnce) {
  EXPECT_THAT(frames("1-3,2-5,9,1"), ElementsAre(1, 2, 3, 4, 5, 9));
  EXPECT_THAT(frames("1-10,10-20"), SizeIs(20));
}

TEST(FrameRange, IsRefusedIfItIsNone) {
  for (const char* text :
       {"", "a", "1-", "-", "1,", ",1", "1,,2", "1-10x", "1-10x0", "1-10x-2", "1-10z2", "1x2",
        "1 2", "1-2-3", "1.5", "+1", "1-10y1", "99999999999999999999", "1-1000000000000000000"})
    EXPECT_THROW((void)frames(text), UsageError) << text;
  try {
    (void)frames("1-x");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("--frames"), HasSubstr("1-x")));
  }
}

TEST(FrameRange, HasAMillionFramesAtMost) {
  EXPECT_THAT(frames("1-1000000"), SizeIs(1'000'000));
  for (const char* text : {"1-1000001", "1-999999999999999", "1-999999999999999y7",
                           "1-999999999999999:999999999999999"})
    EXPECT_THROW((void)frames(text), UsageError) << text;
}

TEST(FrameRange, IsTextWithRanges) {
  EXPECT_EQ(textOfFrames({4}), "4");
  EXPECT_EQ(textOfFrames({-2, -1, 0, 7, 9, 10}), "-2-0, 7, 9-10");
  EXPECT_EQ(textOfFrames({1, 3, 5, 7, 9, 11, 13, 15, 17, 19}),
            "1, 3, 5, 7, 9, 11, 13, 15 and 2 more");
}

}  // namespace
}  // namespace esvr::cli
