/// Plan: the tests check unique names in lists with shared, empty, number-like and component-like
/// names and with names that would control a terminal. Each unique name finds its own grid, and so do
/// the other forms that the header allows. Grids are paired in files of which one lacks some.
//
// The tests parse whole texts as numbers, integers, a number at the start of a text, and lists. Words that people
// mistype find what they mean: a letter too many, too few, wrong or swapped, capitals, underscores, or the begin of a word.
// Words that mean something else find nothing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "core/parse_text.h"
#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "support/messages.h"

namespace esvr {
namespace {

using Names = std::vector<std::string>;
using testing::ElementsAre;
using testing::Optional;

Names uniqueNames(const Names& names) {
  const auto unique = GridNames(names).allUnique();
  return {unique.begin(), unique.end()};
}
std::size_t findGrid(const Names& names, const std::string& wanted, const std::string& file = "") {
  return GridNames(names).findWhole(wanted, file);
}

TEST(GridNames, AreNumberedOnlyWhereShared) {
  EXPECT_THAT(uniqueNames(Names{"a", "b", "a", ""}), ElementsAre("a[0]", "b", "a[1]", "(unnamed)"));
  EXPECT_THAT(uniqueNames(Names{"", ""}), ElementsAre("(unnamed)[0]", "(unnamed)[1]"));
  EXPECT_TRUE(uniqueNames(Names{}).empty());
}

TEST(GridNames, OfThisVeryTextWinOverNumbers) {
  EXPECT_THAT(uniqueNames(Names{"a", "a", "a[1]"}), ElementsAre("a[0]", "a#2", "a[1]"));
  EXPECT_THAT(uniqueNames(Names{"a[0]", "a", "a"}), ElementsAre("a[0]", "a#2", "a[1]"));
  EXPECT_THAT(uniqueNames(Names{"a", "a", "a[0]", "a#1"}),
              ElementsAre("a#1#1", "a[1]", "a[0]", "a#1"));
  EXPECT_THAT(uniqueNames(Names{"", "(unnamed)"}), ElementsAre("(unnamed)[0]", "(unnamed)"));
}

TEST(GridNames, FindTheirOwnGrid) {
  for (const Names& names :
       {Names{"a", "b", "a", "", "c[7]"}, Names{"a", "a", "a[1]"}, Names{"a[0]", "a", "a"},
        Names{"a", "a", "a[0]", "a#1", "a#1#1"}, Names{"", "", "(unnamed)", "(unnamed)[0]", "[0]"},
        Names{"a\x01", "a\x02", "a?", "a?[0]", "a\n"}, Names{"vel", "vel.x", "vel", "vel[0].x"}}) {
    const GridNames grids(names);
    for (std::size_t i = 0; i < names.size(); ++i) {
      EXPECT_EQ(grids.find(grids.unique(i)), (NamedGrid{i})) << grids.unique(i);
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_EQ(grids.find(grids.ofComponent(i, c)), (NamedGrid{i, c}))
            << grids.ofComponent(i, c);
    }
  }
}

TEST(GridNames, AreUniqueTogetherWithThoseOfComponents) {
  const GridNames grids(Names{"vel", "vel.x", "vel[0].x", "vel#1.x", "vel", "vel[1].x"});
  std::set<std::string> all;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    EXPECT_TRUE(all.insert(grids.unique(i)).second);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_TRUE(all.insert(grids.ofComponent(i, c)).second);
  }
}

TEST(GridNames, WinOverComponents) {
  const GridNames grids(Names{"vel", "vel.x"});
  EXPECT_EQ(grids.find("vel.x"), (NamedGrid{1}));
  EXPECT_EQ(grids.find("vel.y"), (NamedGrid{0, 1}));
  EXPECT_EQ(grids.find("vel[0].x"), (NamedGrid{0, 0}));
  EXPECT_EQ(grids.ofComponent(0, 0), "vel[0].x");
  EXPECT_EQ(grids.ofComponent(0, 1), "vel.y");
  EXPECT_THROW((void)grids.findWhole("vel.y"), BadInput);
}

TEST(GridNames, MayAlwaysBeNumbered) {
  const Names names{"x", "a", "a", ""};
  EXPECT_EQ(findGrid(names, "x[0]"), 0u);
  EXPECT_EQ(findGrid(names, "x#1"), 0u);
  EXPECT_EQ(findGrid(names, "a#3"), 2u);
  EXPECT_EQ(findGrid(names, ""), 3u);
  EXPECT_EQ(findGrid(names, "(unnamed)"), 3u);
  EXPECT_EQ(findGrid(names, "[0]"), 3u);
  for (const char* none :
       {"a#1", "x#0", "x#9", "x[1]", "x[", "x[]", "x]", "#", "x#", ".x", "a[-1]"})
    EXPECT_THROW((void)findGrid(names, none), BadInput) << none;
}

TEST(GridNames, AreToldWhereTheyAreAmbiguous) {
  const Names names{"x", "a", "a"};
  EXPECT_THAT(
      [&] { (void)findGrid(names, "a", "smoke.vdb"); },
      test::ThrowsSaying<BadInput>("smoke.vdb: has 2 grids \"a\"",
                                   "\"a[0]\" (grid 2 of the file), \"a[1]\" (grid 3 of the file)"));
}

TEST(GridNames, AreListedForAnUnknownName) {
  const Names names{"a", "a", "b"};
  EXPECT_THAT([&] { (void)findGrid(names, "a[2]", "smoke.vdb"); },
              test::ThrowsSaying<BadInput>("smoke.vdb: ", "\"a[2]\"", "\"a[0]\", \"a[1]\", \"b\""));
  EXPECT_THAT([&] { (void)findGrid(Names{}, "a"); }, test::ThrowsSaying<BadInput>("none"));
  EXPECT_THAT([&] { (void)findGrid(Names(1000, "b"), "a"); },
              test::ThrowsSaying<BadInput>("and 980 more"));
}

TEST(GridNames, AreFoundInConstantTime) {
  constexpr std::size_t kGrids = 50'000;  // would take minutes if a search were linear
  std::vector<std::string> names(kGrids, "same");
  const GridNames grids(names);
  for (std::size_t i = 0; i < kGrids; ++i) ASSERT_EQ(grids.find(grids.unique(i)).place, i);
}

TEST(ShownText, CannotControlATerminal) {
  const auto shown = [](std::string_view text) { return shownText(text, LineEnds::kReplace); };
  EXPECT_EQ(shown("plain, \xc3\xa9\xe6\x97\xa5\xf0\x9f\x8c\xab"),
            "plain, \xc3\xa9\xe6\x97\xa5\xf0\x9f\x8c\xab");
  EXPECT_EQ(shown("\x1b[2J\x7f\n\r\t"), "?[2J????");
  EXPECT_EQ(shown("\xc2\x80\xc2\x9b\xc2\x9f\xc2\xa0"), "???\xc2\xa0");  // U+0080, U+009B, U+009F
  EXPECT_EQ(shown("\x9b\xff\xc3"), "???");                              // bytes that are not UTF-8
  for (const char* mark : {"\xd8\x9c", "\xe2\x80\x8e", "\xe2\x80\x8f", "\xe2\x80\xa8",
                           "\xe2\x80\xaa", "\xe2\x80\xae", "\xe2\x81\xa6", "\xe2\x81\xa9"})
    EXPECT_EQ(shown(mark), "?");
  EXPECT_EQ(shown("\xe2\x80\x8d\xe2\x81\xa5\xe2\x81\xaa").size(), 9u);  // beside the marks
  EXPECT_EQ(shownText("a\n\x01", LineEnds::kKeep), "a\n?");
  EXPECT_EQ(shownName(""), "(unnamed)");
  EXPECT_EQ(shownName("a\n"), "a?");
}

GridTraits traits(std::string name, std::uint64_t voxels, std::string type = "float") {
  return {.name = std::move(name), .valueType = std::move(type), .activeVoxels = voxels};
}

TEST(PairedGrids, HaveTheSameNumberWhereNoneIsMissing) {
  const std::vector<GridTraits> a{traits("d", 1), traits("e", 1), traits("d", 2)};
  const std::vector<GridTraits> b{traits("d", 2), traits("d", 1), traits("f", 1)};
  EXPECT_THAT(pairGrids(a, b), ElementsAre(Optional(0u), std::nullopt, Optional(1u)));
}

TEST(PairedGrids, AreThoseThatAgreeWhereOthersAreMissing) {
  const std::vector<GridTraits> all{traits("d", 1), traits("d", 2, "int32"), traits("d", 3)};
  EXPECT_THAT(pairGrids(all, std::vector{all[1], all[2]}),
              ElementsAre(std::nullopt, Optional(0u), Optional(1u)));
  EXPECT_THAT(pairGrids(all, std::vector{all[1]}),
              ElementsAre(std::nullopt, Optional(0u), std::nullopt));
  EXPECT_THAT(pairGrids(std::vector{all[2]}, all), ElementsAre(Optional(2u)));
  std::vector<GridTraits> alike(3, traits("d", 1));
  for (std::size_t g = 0; g < alike.size(); ++g) alike[g].values = {0.0f, float(g + 1)};
  GridTraits lossy = alike[2];
  lossy.values = {0.0f, 2.95f};
  EXPECT_THAT(pairGrids(alike, std::vector{alike[1], lossy}),
              ElementsAre(std::nullopt, Optional(0u), Optional(1u)));
  EXPECT_THAT(pairGrids(all, std::vector{traits("d", 9)}),
              ElementsAre(Optional(0u), std::nullopt, std::nullopt));
}

TEST(ClassNames, AreThoseOfOpenVdb) {
  EXPECT_STREQ(className(GridClass::kLevelSet), "level set");
  EXPECT_STREQ(className(GridClass::kFogVolume), "fog volume");
  EXPECT_STREQ(className(GridClass::kStaggered), "staggered");
  EXPECT_STREQ(className(GridClass::kUnknown), "unknown");
}

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
