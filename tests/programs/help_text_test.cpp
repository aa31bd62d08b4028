// Plan: lines are broken between words, at the last place that keeps to the width; what has
// columns is kept, and so are empty lines, and a word that is too long stands alone. A man page
// has all parts of a help text, with the characters escaped that man(7) would take as commands,
// and the options are named for completion.

#include "programs/help_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/program_options/value_semantic.hpp>

namespace esvr::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(WrappedText, BreaksLinesAtTheLastPossibleSpace) {
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("one two three", 6), "one\ntwo\nthree");
  EXPECT_EQ(wrapped("one two three", 13), "one two three");
}

TEST(WrappedText, LeavesALongWordWhole) {
  EXPECT_EQ(wrapped("a incomprehensible b", 5), "a\nincomprehensible\nb");
}

TEST(WrappedText, KeepsColumnsAndEmptyLines) {
  EXPECT_EQ(wrapped("one two\n\n  a    long table\nthree four", 5),
            "one\ntwo\n\n  a    long table\nthree\nfour");
}

TEST(WrappedText, MayBeEmpty) { EXPECT_EQ(wrapped("", 80), ""); }

namespace po = boost::program_options;

class ManPage : public testing::Test {
 protected:
  ManPage() {
    // clang-format off
    own_.add_options()
      ("grid,g", po::value<std::string>()->value_name("NAME"), "write this grid\n.only")
      ("no-tiles", po::bool_switch(), "write leaves");
    // clang-format on
  }
  po::options_description own_;
  ProgramText text_{.name = "esvr-example table",
                    .purpose = "Converts an .esvr file back. It says so.",
                    .usage = "  esvr-example table IN",
                    .notes = "'quoted' \\ note\n\n  a  table\nmore",
                    .examples = ""};
};

TEST_F(ManPage, hasTheNameAndTheFirstSentence) {
  const std::string page = manPage(text_, {{"OPTIONS", &own_}});
  EXPECT_THAT(page, HasSubstr(".TH ESVR-EXAMPLE-TABLE 1 "));
  EXPECT_THAT(page, HasSubstr("esvr\\-example\\-table \\- Converts an .esvr file back\n"));
  EXPECT_THAT(page, HasSubstr(".SH SYNOPSIS\n.nf\n  esvr\\-example table IN\n.fi\n"));
  EXPECT_THAT(page, HasSubstr("It says so."));
  EXPECT_THAT(page, Not(HasSubstr("EXAMPLES"))) << "an empty section";
}

TEST_F(ManPage, hasTheOptions) {
  const std::string page = manPage(text_, {{"OPTIONS", &own_}});
  EXPECT_THAT(page, HasSubstr(".TP\n\\fB\\-g\\fR, \\fB\\-\\-grid\\fR \\fINAME\\fR\n"));
  EXPECT_THAT(page, HasSubstr(".TP\n\\fB\\-\\-no\\-tiles\\fR\nwrite leaves\n"));
}

TEST_F(ManPage, escapesWhatBeginsACommand) {
  const std::string page = manPage(text_, {{"OPTIONS", &own_}});
  EXPECT_THAT(page, HasSubstr("write this grid\n\\&.only"));
  EXPECT_THAT(page, HasSubstr("\\&'quoted' \\e note"));
}

TEST_F(ManPage, keepsTheColumnsOfLinesThatBeginWithASpace) {
  const std::string page = manPage(text_, {{"OPTIONS", &own_}});
  EXPECT_THAT(page, HasSubstr(".SH NOTES\n\\&'quoted'"));
  EXPECT_THAT(page, HasSubstr("\n.nf\n  a  table\n.fi\n.PP\nmore\n"));
}

TEST_F(ManPage, namesOptionsForCompletion) {
  EXPECT_EQ(optionNames({{"OPTIONS", &own_}}), "--grid\n--no-tiles\n");
}

}  // namespace
}  // namespace esvr::cli
