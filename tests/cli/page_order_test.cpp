// Plan: a record with rows of all groups is ordered. The tests check that each row has one place,
// that the rows of a file of ESVR stand beside it, and which rows stand out.

#include "compare/page_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace esvr::compare {
namespace {

using report::Emphasis;
using testing::ElementsAre;

TableRow measured(const std::string& name, const std::string& group, std::uint64_t bytes,
                  double psnr) {
  TableRow made{.name = name, .group = group, .bytes = bytes};
  made.metrics = VolumeMetrics{};
  made.metrics->psnrBox = psnr;
  return made;
}

TableRecord orderedRows() {
  TableRecord made;
  made.rows = {
      measured("large", kOurGroup, 9000, 50.0),    measured("small", kOurGroup, 1000, 40.0),
      measured("Blosc", "lossless", 99000, 140.0), measured("a", "at 1000 bytes", 990, 30.0),
      measured("b", "at 9000 bytes", 8990, 45.0),  measured("c", "at 40.00 dB", 2000, 40.1),
      measured("d", "at 500 bytes", 490, 20.0)};
  made.rows[3].matchedBytes = 1000;
  made.rows[4].matchedBytes = 9000;
  made.rows[5].matchedPsnr = 40.0;
  made.rows[6].matchedBytes = 500;
  return made;
}

std::vector<std::string> linesOf(const PageOrder& order) {
  std::vector<std::string> lines;
  for (const auto& group : order.groups()) {
    lines.push_back(group.heading + (group.ofOneSize ? " =" : ""));
    for (const TableRow* row : group.rows) lines.push_back("  " + row->name);
  }
  return lines;
}

TEST(PageOrder, putsRowsBesideTheFileOfTheirSize) {
  const TableRecord rows = orderedRows();
  EXPECT_THAT(linesOf(PageOrder(rows)),
              ElementsAre("at most 1000 bytes (1 KB) =", "  small", "  a", "at 40.00 dB", "  c",
                          "at most 9000 bytes (9 KB) =", "  large", "  b", "lossless", "  Blosc",
                          "at 500 bytes =", "  d"));
}

TEST(PageOrder, marksEsvrAndItsRivals) {
  const TableRecord rows = orderedRows();
  const PageOrder order(rows);
  EXPECT_EQ(order.emphasisOf(rows.rows[0]), Emphasis::kOurs);
  EXPECT_EQ(order.emphasisOf(rows.rows[3]), Emphasis::kRival);
  EXPECT_EQ(order.emphasisOf(rows.rows[4]), Emphasis::kRival);
  EXPECT_EQ(order.emphasisOf(rows.rows[6]), Emphasis::kNone);
}

}  // namespace
}  // namespace esvr::compare
