// Plan: SWC text becomes a skeleton, every wrong line is refused with its number, and the tubes and
// pieces of a skeleton are right.

#include "generators/skeleton.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "esvr/error.h"

namespace esvr::samples {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

Skeleton parse(const std::string& text) {
  std::istringstream stream(text);
  return parseSwc(stream, "test.swc");
}

TEST(ParseSwc, readsNodesAmongCommentsBlanksAndCarriageReturns) {
  const auto s = parse("# made by hand\r\n\n 1 1 0 0 0 2.5 -1 # soma\n2\t3 +1.5 -2e1 .5 0 1\r\n");
  ASSERT_EQ(s.size(), 2u);
  EXPECT_EQ(s[0].radius, 2.5);
  EXPECT_FALSE(s[0].parent.has_value());
  EXPECT_EQ(s[1].position.y, -20.0);
  EXPECT_EQ(s[1].parent, 0u);
}

TEST(ParseSwc, takesParentsThatComeLater) {
  const auto s = parse("7 0 0 0 0 1 9\n9 0 1 0 0 1 -1\n");
  EXPECT_EQ(s[0].parent, 1u);
}

TEST(ParseSwc, ignoresColumnsBeyondTheSeventh) {
  EXPECT_EQ(parse("1 0 0 0 0 1 -1 extra 5\n").size(), 1u);
}

struct BadSwc {
  const char* text;
  const char* line;
  const char* reason;
};

class RefusedSwc : public testing::TestWithParam<BadSwc> {};

TEST_P(RefusedSwc, namesFileLineAndReason) {
  EXPECT_THAT([] { (void)parse(GetParam().text); },
              ThrowsMessage<BadInput>(AllOf(HasSubstr("test.swc"), HasSubstr(GetParam().line),
                                            HasSubstr(GetParam().reason))));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedSwc,
    testing::Values(BadSwc{"", "", "no node"}, BadSwc{"# nothing\n", "", "no node"},
                    BadSwc{"1 0 0 0 0 1\n", "line 1", "7 columns, but the line has 6"},
                    BadSwc{"#\n1 0 zero 0 0 1 -1\n", "line 2", "'zero'"},
                    BadSwc{"1 0 0 0 0 nan -1\n", "line 1", "not finite"},
                    BadSwc{"1 0 0 inf 0 1 -1\n", "line 1", "not finite"},
                    BadSwc{"1 0 0 0 1e999 1 -1\n", "line 1", "1e999"},
                    BadSwc{"1 0 0 0 0 -2 -1\n", "line 1", "radius is negative"},
                    BadSwc{"1.5 0 0 0 0 1 -1\n", "line 1", "'1.5'"},
                    BadSwc{"-4 0 0 0 0 1 -1\n", "line 1", "id is negative"},
                    BadSwc{"1 0 0 0 0 1 -1\n1 0 1 0 0 1 -1\n", "line 2", "defined twice"},
                    BadSwc{"1 0 0 0 0 1 1\n", "line 1", "its own parent"},
                    BadSwc{"1 0 0 0 0 1 -1\n2 0 1 0 0 1 5\n", "line 2", "parent 5 does not exist"},
                    BadSwc{"\x7f"
                           "ELF\x02\x01 binary\n",
                           "line 1", "7 columns"}));

TEST(TubesOf, linkEveryNodeToItsParentAndKeepLonelyNodesAsBalls) {
  const auto tubes =
      tubesOf(parse("1 0 0 0 0 3 -1\n2 0 5 0 0 1 1\n3 0 5 5 0 1 2\n4 0 9 9 9 2 -1\n"));
  ASSERT_EQ(tubes.size(), 3u);
  EXPECT_EQ(tubes[0].a.x, 5.0);
  EXPECT_EQ(tubes[0].b.x, 0.0);
  EXPECT_EQ(tubes[0].radiusA, 1.0);
  EXPECT_EQ(tubes[0].radiusB, 3.0);
  EXPECT_EQ(tubes[2].a.z, 9.0);
  EXPECT_EQ(tubes[2].b.z, 9.0);
}

TEST(LongestPieces, keepsThePiecesOfLongestCable) {
  // The pieces have lengths of 1 (nodes 1, 2), 3 (10, 11, 12) and 0 (20), in mixed order.
  const auto s = parse(
      "1 0 0 0 0 1 -1\n11 0 2 0 0 1 10\n2 0 1 0 0 1 1\n10 0 0 0 0 1 -1\n12 0 2 1 0 1 11\n"
      "20 0 7 7 7 1 -1\n");
  const auto longest = longestPieces(s, 1);
  ASSERT_EQ(longest.size(), 3u);
  EXPECT_EQ(longest[0].position.x, 2.0);
  EXPECT_EQ(longest[0].parent, 1u) << "parents are renumbered";
  EXPECT_FALSE(longest[1].parent.has_value());
  EXPECT_EQ(longest[2].parent, 0u);
  EXPECT_EQ(longestPieces(s, 2).size(), 5u);
  EXPECT_EQ(longestPieces(s, 99).size(), 6u);
}

}  // namespace
}  // namespace esvr::samples
