// Plan: a small table is checked for what readers, screen readers and scripts need: a caption, the
// scopes of headers, groups, folded figures, rows that stand out, and numbers with all digits.

#include "report/html_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace esvr::report {
namespace {

using testing::HasSubstr;
using testing::Not;

FigureTable figures() {
  return {.table = {"Sizes & errors",
                    {{"name", "row", Kind::kText},
                     {"bytes", "bytes", Kind::kBytes, "size of the file"},
                     {"error", "error", Kind::kError},
                     {"fps", "FPS"},
                     {"note", "note", Kind::kText}},
                    {{std::string("<ESVR>"), 46000.0, 1.0 / 3.0, Cell(), std::string("one fit")},
                     {std::string("ZFP"), 45000.0, std::numeric_limits<double>::infinity(), Cell(),
                      std::string()},
                     {std::string("raw"), Cell(), Cell(), Cell(), std::string("out of reach")}}},
          .folded = {"note"},
          .reason = "note",
          .groups = {{"of one size", 2}, {"others", 1}},
          .emphasis = {Emphasis::kOurs, Emphasis::kRival},
          .best = {{0, 2}}};
}

TEST(HtmlTable, saysWhatItsHeadersAreOf) {
  const std::string html = toHtml(figures()).markup;
  EXPECT_THAT(html, HasSubstr("<caption><span>Sizes &amp; errors</span></caption>"));
  EXPECT_THAT(html, HasSubstr("<th scope=\"col\" title=\"size of the file\">bytes</th>"));
  EXPECT_THAT(html, HasSubstr("<th scope=\"row\">&lt;ESVR&gt;</th>"));
  EXPECT_THAT(html, HasSubstr("<th scope=\"rowgroup\" colspan=\"3\"><span>of one size</span>"));
}

TEST(HtmlTable, hasNumbersForReadersAndForScripts) {
  const std::string html = toHtml(figures()).markup;
  EXPECT_THAT(html, HasSubstr("data-value=\"0.3333333333333333\" class=\"best\">0.33</td>"));
  EXPECT_THAT(html, HasSubstr("<td data-value=\"46000\">46000</td>"));
  EXPECT_THAT(html, HasSubstr("data-value=\"Infinity\""));
}

TEST(HtmlTable, marksRows) {
  const std::string html = toHtml(figures()).markup;
  EXPECT_THAT(html, HasSubstr("<tr class=\"row ours\">"));
  EXPECT_THAT(html, HasSubstr("<tr class=\"row rival\">"));
}

TEST(HtmlTable, foldsFiguresAndLeavesEmptyColumnsOut) {
  const std::string html = toHtml(figures()).markup;
  EXPECT_THAT(html, HasSubstr("<dt>note</dt>\n<dd class=\"text\">one fit</dd>"));
  EXPECT_THAT(html, Not(HasSubstr(">note</th>")));
  EXPECT_THAT(html, Not(HasSubstr("FPS")));
}

TEST(HtmlTable, saysWhyARowHasNoFigures) {
  EXPECT_THAT(toHtml(figures()).markup,
              HasSubstr("<td class=\"reason\" colspan=\"2\">out of reach</td>"));
}

TEST(HtmlTable, mayHaveNoGroups) {
  FigureTable plain = figures();
  plain.groups.clear();
  const std::string html = toHtml(plain).markup;
  EXPECT_THAT(html, Not(HasSubstr("rowgroup")));
  EXPECT_THAT(html, HasSubstr("out of reach"));
}

}  // namespace
}  // namespace esvr::report
