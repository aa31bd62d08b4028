// Plan: the tests parse whole texts as numbers, integers, a number at the start of a text, and lists. Words that people
// mistype find what they mean: a letter too many, too few, wrong or swapped, capitals, underscores, or the begin of a word.
// Words that mean something else find nothing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/parse_text.h"
#include "esvr/did_you_mean.h"

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

using Words = std::vector<std::string>;

const Words kOptions{"--psnr", "--max-error", "--max-memory", "--grid", "--lod", "--half"};

TEST(DidYouMean, NamesTheWordOfOneWrongLetter) {
  for (const char* given : {"--max-eror", "--max-errror", "--max-errot", "--max-erorr",
                            "--maxerror", "--MAX-ERROR", "--max_error"})
    EXPECT_EQ(didYouMean(given, kOptions), "; did you mean --max-error?") << given;
  EXPECT_EQ(didYouMean("--grids", kOptions), "; did you mean --grid?");
}

TEST(DidYouMean, NamesTheNearestOfSeveralAndTheFirstOfEqualOnes) {
  EXPECT_EQ(didYouMean("tesl", Words{"test", "tell", "toss"}), "; did you mean test?");
  EXPECT_EQ(didYouMean("heatt", Words{"head", "heat"}), "; did you mean heat?");
}

TEST(DidYouMean, PrefersAWordThatGoesOn) {
  EXPECT_EQ(didYouMean("of", Words{"on", "off"}), "; did you mean off?");
}

TEST(DidYouMean, TakesTheBeginOfAWord) {
  EXPECT_EQ(didYouMean("dens", Words{"flame", "density"}, "\""), "; did you mean \"density\"?");
  EXPECT_EQ(didYouMean("de", Words{"flame", "density"}), "") << "two letters say little";
}

TEST(DidYouMean, IsSilentWhereNothingIsNear) {
  EXPECT_EQ(didYouMean("--color", kOptions), "");
  EXPECT_EQ(didYouMean("smoke", Words{"density", "flame"}), "");
  EXPECT_EQ(didYouMean("", Words{"a", ""}), "");
  EXPECT_EQ(didYouMean("x", Words{"y"}), "") << "all letters differ";
  EXPECT_EQ(didYouMean("density", Words{}), "");
}

TEST(DidYouMean, IsSilentAboutAKnownWord) {
  EXPECT_EQ(didYouMean("colors", Words{"color", "colors"}), "");
}

TEST(DidYouMean, DoesNotCompareVeryLongWords) {
  const std::string longName(1000, 'a');
  EXPECT_EQ(didYouMean(longName + "b", Words{longName}), "");
}

}  // namespace
}  // namespace esvr
