// Plan: the tests read the JSON from which the script of a page draws a chart (browser_test.cpp). It has every
// point that can be shown, and no text of it ends its element.

#include "report/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace esvr::report {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

Chart curves() {
  return {.title = "Error over size",
          .x = {"size of the file", Unit::kBytes, true},
          .y = {"error, %", Unit::kPercent, true},
          .series = {{.name = "ESVR",
                      .points = {{1e4, 0.5, "46.02 dB"}, {1e5, 0.02}},
                      .emphasis = Emphasis::kOurs},
                     {.name = "</script>", .points = {{2e4, 4.0}}, .joined = false}}};
}

json jsonOf(const Chart& chart) {
  const std::string html = toHtml(chart).markup, start = "<script type=\"application/json\">";
  const std::size_t begin = html.find(start) + start.size();
  return json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

TEST(Chart, SaysWhatItsAxesAndItsSeriesAre) {
  const json chart = jsonOf(curves());
  EXPECT_EQ(chart["x"],
            (json{{"label", "size of the file"}, {"unit", "bytes"}, {"logarithmic", true}}));
  EXPECT_EQ(chart["y"]["unit"], "percent");
  EXPECT_EQ(chart["y"]["decibels"], false);
  EXPECT_EQ(chart["series"][0]["points"],
            json::parse(R"([[1e4, 0.5, "46.02 dB"], [1e5, 0.02, ""]])"));
  EXPECT_EQ(chart["series"][0]["ours"], true);
  EXPECT_EQ(chart["series"][1]["joined"], false);
  EXPECT_THAT(toHtml(curves()).markup,
              HasSubstr("aria-label=\"Error over size: error, % over size of the file\""));
}

TEST(Chart, KeepsNamesFromEndingItsElement) {
  EXPECT_EQ(jsonOf(curves())["series"][1]["name"], "</script>");
}

TEST(Chart, PassesOverWhatCannotBeShown) {
  Chart with = curves();
  for (const double y : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity()})
    with.series[1].points.push_back({3e5, y});
  EXPECT_EQ(jsonOf(with)["series"][1]["points"].size(), 1u);
  with.y.logarithmic = false;
  EXPECT_EQ(jsonOf(with)["series"][1]["points"].size(), 3u);
}

TEST(Chart, IsThereWithoutCurves) {
  EXPECT_EQ(jsonOf(Chart{.title = "None"})["series"], json::array());
}

}  // namespace
}  // namespace esvr::report
