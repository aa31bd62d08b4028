// Plan: figures are rounded to three digits without an exponent, and change from one unit to the
// next. Cells are formatted for readers and for programs, and tables in each form.

#include "programs/data_table.h"

#include <gtest/gtest.h>

#include <limits>

namespace esvr::report {
namespace {

TEST(PlainText, hasThreeDigitsAndNoExponent) {
  EXPECT_EQ(plainText(0.000012345), "0.0000123");
  EXPECT_EQ(plainText(258432.0), "258000");
  EXPECT_EQ(plainText(0.1), "0.1");
  EXPECT_EQ(plainText(0.0), "0");
  EXPECT_EQ(plainText(-2.5), "-2.5");
}

TEST(BytesText, takesTheUnitThatFits) {
  EXPECT_EQ(bytesText(800), "800 B");
  EXPECT_EQ(bytesText(45059), "45.1 KB");
  EXPECT_EQ(bytesText(999'499), "999 KB");
  EXPECT_EQ(bytesText(999'500), "1 MB") << "is rounded to the next unit";
  EXPECT_EQ(bytesText(2.6e9), "2.6 GB");
  EXPECT_EQ(bytesText(5e15), "5000 TB") << "the last unit";
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

DataTable table() {
  return {"Sizes",
          {{"name", "row", Kind::kText},
           {"bytes", "bytes", Kind::kBytes},
           {"psnr", "PSNR", Kind::kDecibels}},
          {{std::string("a, \"b\""), 48214.0, 44.712}, {std::string("c|d"), Cell(), kInfinity}}};
}

TEST(CellText, isShortForPeople) {
  EXPECT_EQ(cellText({"", "", Kind::kBytes}, 1234567.0), "1234567");
  EXPECT_EQ(cellText({"", "", Kind::kMegabytes}, 1234567.0), "1.23");
  EXPECT_EQ(cellText({"", "", Kind::kDecibels}, 44.7123), "44.71");
  EXPECT_EQ(cellText({"", "", Kind::kDecibels}, kInfinity), "exact");
  EXPECT_EQ(cellText({"", "", Kind::kShare}, 0.99876), "0.9988");
  EXPECT_EQ(cellText({"", "", Kind::kNumber}, 0.00123456), "0.00123");
  EXPECT_EQ(cellText({"", "", Kind::kNumber}, Cell()), "-");
  EXPECT_EQ(cellText({"", "", Kind::kText}, std::string("x")), "x");
}

TEST(ExactText, losesNothing) {
  EXPECT_EQ(exactText(1.0 / 3.0), "0.3333333333333333");
  EXPECT_EQ(exactText(kInfinity), "inf");
  EXPECT_EQ(exactText(Cell()), "");
}

TEST(Csv, quotesWhatItMust) {
  EXPECT_EQ(toCsv(table()), "name,bytes,psnr\n\"a, \"\"b\"\"\",48214,44.712\nc|d,,inf\n");
}

TEST(Markdown, isATableUnderAHeading) {
  EXPECT_EQ(toMarkdown(table()),
            "## Sizes\n\n| row | bytes | PSNR |\n|---|--:|--:|\n| a, \"b\" | 48214 | 44.71 |\n"
            "| c\\|d | - | exact |\n");
}

TEST(Markdown, escapesTextOfUnknownOrigin) {
  EXPECT_EQ(markdownText("a_b|c`<d>\\[e]*\nf\x1b"), "a\\_b\\|c\\`\\<d\\>\\\\\\[e\\]\\* f?");
  EXPECT_EQ(markdownCode("plain"), "`plain`");
  EXPECT_EQ(markdownCode("a `b`` c\n"), "``` a `b`` c? ```");
  DataTable named = table();
  named.title = "<b>\n# x";
  named.rows[0][0] = std::string("[x](y)");
  const std::string text = toMarkdown(named);
  EXPECT_NE(text.find("## \\<b\\> \\# x\n"), std::string::npos) << text;
  EXPECT_NE(text.find("| \\[x\\](y) |"), std::string::npos) << text;
}

TEST(WithColumns, takesThemInTheirOrder) {
  const DataTable some = withColumns(table(), {"psnr", "name"});
  ASSERT_EQ(some.columns.size(), 2u);
  EXPECT_EQ(some.columns[0].key, "psnr");
  EXPECT_EQ(exactText(some.rows[0][1]), "a, \"b\"");
  EXPECT_THROW((void)withColumns(table(), {"colour"}), std::logic_error);
}

}  // namespace
}  // namespace esvr::report
