// Plan: records of a few rows are made by hand. The tests check which rival is chosen, and the
// sentence for each outcome: more, less, as much, no rival, no error, several files. A record with
// rows of all groups is ordered. The tests check that each row has one place, that the rows of a
// file of ESVR stand beside it, and which rows stand out.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "compare/finding.h"

namespace esvr::compare {
namespace {

using testing::ElementsAre;

TableRow row(const std::string& name, const std::string& group, std::uint64_t bytes, double psnr) {
  TableRow made{.name = name, .group = group, .bytes = bytes};
  made.metrics = VolumeMetrics{};
  made.metrics->psnrBox = psnr;
  return made;
}
TableRow ours(std::uint64_t bytes, double psnr) {
  return row("fit" + std::to_string(bytes) + ".esvr", kOurGroup, bytes, psnr);
}
TableRow rival(std::uint64_t bytes, double psnr, const std::string& name = "ZFP") {
  return row(name, "at some bytes", bytes, psnr);
}

std::string finding(const std::vector<TableRow>& rows) {
  TableRecord record;
  record.rows = rows;
  return findingOf(record);
}

TEST(Finding, saysHowMuchMoreEsvrHas) {
  EXPECT_EQ(finding({ours(46000, 52.34), rival(45900, 43.2), rival(45000, 40.0, "FpN")}),
            "At 46 KB, ESVR has a PSNR of 52.3 dB, 9.1 dB more than the best rival, ZFP.");
}

TEST(Finding, saysHowMuchLessEsvrHas) {
  EXPECT_EQ(finding({ours(46000, 40.0), rival(45900, 43.24)}),
            "At 46 KB, ESVR has a PSNR of 40.0 dB, 3.2 dB less than the best rival, ZFP.");
}

TEST(Finding, isATieWhereTheDifferenceWouldBeZero) {
  for (const double psnr : {40.04, 40.0, 39.96})
    EXPECT_EQ(finding({ours(46000, 40.0), rival(46000, psnr)}),
              "At 46 KB, ESVR has a PSNR of 40.0 dB, as much as the best rival, ZFP.");
}

TEST(Finding, saysThatThereIsNoRival) {
  EXPECT_EQ(finding({ours(46000, 40.0), rival(60000, 43.0)}),
            "At 46 KB, ESVR has a PSNR of 40.0 dB; no other row is that small.");
  EXPECT_EQ(finding({rival(60000, 43.0)}), "") << "nothing of ESVR";
}

TEST(Finding, isOpenAboutARivalWithoutAnError) {
  EXPECT_EQ(finding({ours(46000, 40.0), rival(30000, INFINITY, "zip")}),
            "At 46 KB, ESVR has a PSNR of 40.0 dB; the best rival, zip, has no error.");
}

TEST(Finding, comparesSizesWhereEsvrHasNoError) {
  EXPECT_EQ(finding({ours(46000, INFINITY), rival(60000, INFINITY, "zip"), rival(40000, 90.0)}),
            "ESVR stores the volume without an error in 46 KB, the best rival, zip, in 60 KB.");
  EXPECT_EQ(finding({ours(46000, INFINITY), rival(40000, 90.0)}),
            "ESVR stores the volume without an error in 46 KB.");
}

TEST(Finding, hasAllFilesOfEsvr) {
  EXPECT_EQ(finding({ours(90000, 52.0), rival(90000, 48.5), ours(6500, 35.0), rival(6400, 33.8)}),
            "ESVR has a higher PSNR than the best rival for all 2 files, from 6.5 KB to 90 KB, by "
            "1.2 to 3.5 dB.");
  EXPECT_EQ(
      finding({ours(90000, 47.0), rival(90000, 48.5), ours(6500, 35.0), rival(6400, 33.8)}),
      "ESVR has a higher PSNR than the best rival for 1 of 2 files, from 6.5 KB to 90 KB; the "
      "difference is between -1.5 dB and 1.2 dB.");
  EXPECT_EQ(finding({ours(90000, 47.0), rival(90000, 48.5), ours(6500, 33.0), rival(6400, 33.8)}),
            "ESVR has a higher PSNR than the best rival for none of 2 files, from 6.5 KB to 90 KB; "
            "the difference is between -1.5 dB and -0.8 dB.");
}

TEST(Finding, countsFilesWithoutARivalAndFilesWithoutAnError) {
  EXPECT_EQ(finding({ours(2000, 30.0), ours(3000, 32.0), ours(46000, 52.3), rival(45900, 43.2)}),
            "At 46 KB, ESVR has a PSNR of 52.3 dB, 9.1 dB more than the best rival, ZFP. No other "
            "row is as small as its 2 smallest files.");
  EXPECT_EQ(finding({ours(46000, 52.3), rival(45900, 43.2), ours(99000, INFINITY)}),
            "At 46 KB, ESVR has a PSNR of 52.3 dB, 9.1 dB more than the best rival, ZFP. ESVR "
            "stores the volume without an error in 99 KB.");
}

TEST(Duels, takeTheBestRowThatIsNotLarger) {
  TableRecord record;
  record.rows = {ours(10000, 40.0),
                 rival(10200, 38.0, "as large"),
                 rival(10201, 50.0, "larger"),
                 rival(9000, 37.0, "worse"),
                 rival(9500, 38.0, "smaller"),
                 {.name = "none", .group = "at some bytes", .note = "out of reach"}};
  const auto duels = duelsOf(record);
  ASSERT_EQ(duels.size(), 1u);
  ASSERT_NE(duels[0].rival, nullptr);
  EXPECT_EQ(duels[0].rival->name, "smaller") << "of equal PSNR";
}

using report::Emphasis;

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
