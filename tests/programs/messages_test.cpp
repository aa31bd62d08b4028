// Plan: a table of known cells is printed at several widths. No line is longer than the width, every
// cell is there, and rows keep their names, whatever is too wide.

#include "programs/messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace esvr::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string printed(const Table& table, std::size_t width) {
  std::ostringstream out;
  table.print(out, width);
  return out.str();
}

std::size_t longestLine(const std::string& text) {
  std::istringstream stream(text);
  std::size_t longest = 0;
  for (std::string line; std::getline(stream, line);) longest = std::max(longest, line.size());
  return longest;
}

Table smallTable() {
  Table table({"grid", "max error", "PSNR active"});
  table.add({"density", "0.01", "51.54"});
  return table;
}

TEST(Table, IsPrintedAsItIsWhereItFits) {
  const char* const expected =
      "grid     max error  PSNR active\n"
      "density       0.01        51.54\n";
  EXPECT_EQ(printed(smallTable(), 31), expected);
  std::ostringstream out;
  smallTable().print(out);
  EXPECT_EQ(out.str(), expected);
}

TEST(Table, BreaksItsTitlesWhereItIsTooWide) {
  EXPECT_EQ(printed(smallTable(), 30),
            "           max    PSNR\n"
            "grid     error  active\n"
            "density   0.01   51.54\n");
}

TEST(Table, HasSeveralPartsWhereTitlesOfTwoLinesAreTooWide) {
  EXPECT_EQ(printed(smallTable(), 21),
            "           max\n"
            "grid     error\n"
            "density   0.01\n"
            "\n"
            "           PSNR\n"
            "grid     active\n"
            "density   51.54\n");
}

TEST(Table, GivesALongNameALineOfItsOwn) {
  Table table({"grid", "max error", "PSNR active"});
  const std::string name(25, 'n'), longest = 'a' + std::string(100, 'b') + 'c';
  table.add({name, "1", "40.00"});
  table.add({longest, "2", "41.00"});
  table.add({"heat", "3", "42.00"});
  const std::string text = printed(table, 40);
  EXPECT_LE(longestLine(text), 40u);
  EXPECT_THAT(text, AllOf(HasSubstr('\n' + name + "\n          1   40.00\n"),
                          HasSubstr("\nheat      3   42.00\n"), HasSubstr("\nabbb"),
                          HasSubstr("bbb...bbb"), HasSubstr("bbbc\n"), Not(HasSubstr(longest))));
}

}  // namespace
}  // namespace esvr::cli
