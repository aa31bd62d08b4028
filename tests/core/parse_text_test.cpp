// Plan: the tests parse whole texts as numbers, integers, a number at the start of a text, and
// lists.

#include "core/parse_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace esvr {
namespace {

using testing::ElementsAre;

TEST(ParseText, ReadsFiniteNumbersThatTakeTheWholeText) {
  EXPECT_EQ(parseNumber("-2.5e-1"), -0.25);
  EXPECT_EQ(parseNumber("3"), 3.0);
  for (const char* text : {"", " 1", "1 ", "x", "1x", "nan", "inf", "1e999", "0x10"})
    EXPECT_FALSE(parseNumber(text)) << text;
}

TEST(ParseText, ReadsWholeNumbers) {
  EXPECT_EQ(parseWhole("-12"), -12);
  for (const char* text : {"", "1.5", "1e3", "99999999999999999999"})
    EXPECT_FALSE(parseWhole(text)) << text;
}

TEST(ParseText, TellsTheNumberFromItsUnit) {
  const auto number = parseLeadingNumber("2.5MB");
  ASSERT_TRUE(number);
  EXPECT_EQ(number->value, 2.5);
  EXPECT_EQ(number->rest, "MB");
  EXPECT_FALSE(parseLeadingNumber("MB"));
}

TEST(ParseText, SplitsAtEverySeparator) {
  EXPECT_THAT(splitText("a,b,,c", ','), ElementsAre("a", "b", "", "c"));
  EXPECT_THAT(splitText("", ','), ElementsAre(""));
}

}  // namespace
}  // namespace esvr
