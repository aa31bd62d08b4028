// Plan: the tests read the drawings for wide and for narrow screens. Each axis has at least three
// ticks, the title of each point has its values, and no text leaves the drawing.

#include "report/html_chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <regex>

#include "report/units.h"

namespace esvr::report {
namespace {

using testing::HasSubstr;
using testing::Not;

Plot curves() {
  return {.title = "Error over size",
          .xLabel = "size of the file",
          .yLabel = "error, %",
          .logarithmicX = true,
          .logarithmicY = true,
          .textX = bytesText,
          .textY = percentText,
          .series = {{.name = "ESVR",
                      .points = {{1e4, 0.5, "46.02 dB"}, {1e5, 0.02}},
                      .emphasis = Emphasis::kOurs},
                     {.name = "<ZFP>", .points = {{2e4, 4.0}, {2e5, 0.1}}}}};
}

/// The drawing of a name.
std::string drawing(const Plot& of, const std::string& name) {
  const std::string html = toHtml(of).markup;
  const std::size_t begin = html.find("<svg class=\"" + name);
  return html.substr(begin, html.find("</svg>", begin) - begin);
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

/// The labels of an axis, which differ from those of the other one by their unit.
std::size_t labelsWith(const std::string& svg, const std::string& unit) {
  const std::string ticks = svg.substr(svg.find("class=\"ticks\""));
  return count(ticks.substr(0, ticks.find("</g>")), unit + "</text>");
}

TEST(HtmlChart, hasAtLeastThreeTicksOnEachAxisAtEachWidth) {
  for (const char* name : {"wide", "narrow"})
    for (const double factor : {1.001, 1.5, 4.0, 30.0, 1e4, 1e9}) {
      Plot ranged = curves();
      ranged.series = {{.name = "a", .points = {{2e4, 0.03}, {2e4 * factor, 0.03 * factor}}}};
      const std::string svg = drawing(ranged, name);
      EXPECT_GE(labelsWith(svg, "B"), 3u) << name << ", " << factor;
      EXPECT_GE(labelsWith(svg, "%"), 3u) << name << ", " << factor;
    }
}

// A letter of the labels is 7.4 units wide.
TEST(HtmlChart, hasRoomBetweenItsLabels) {
  Plot wide = curves();
  wide.series = {{.name = "a", .points = {{4.5e4, 0.5}, {6.7e6, 0.02}}}};
  for (const char* name : {"wide", "narrow"}) {
    const std::string svg = drawing(wide, name);
    const std::regex label("<text x=\"([0-9.]+)\"[^>]*>([^<]*B)</text>");
    double end = 0.0;
    for (std::sregex_iterator it(svg.begin(), svg.end(), label), none; it != none; ++it) {
      const double x = std::stod((*it)[1]), half = 3.7 * double((*it)[2].length());
      EXPECT_GE(x - half, end) << name << ", " << (*it)[2];
      end = x + half;
    }
    EXPECT_GT(end, 0.0) << "no label was found";
  }
}

TEST(HtmlChart, saysTheValuesOfItsPoints) {
  const std::string svg = drawing(curves(), "wide");
  EXPECT_THAT(svg, HasSubstr("<title>ESVR\n10 KB, 0.5 %\n46.02 dB</title>"));
  EXPECT_THAT(svg, HasSubstr("<title>&lt;ZFP&gt;\n20 KB, 4 %</title>"));
  EXPECT_EQ(count(svg, "<circle"), 4u);
  EXPECT_THAT(svg, HasSubstr("aria-label=\"Error over size: error, % over size of the file\""));
}

TEST(HtmlChart, drawsOursLastAndNamesIt) {
  const std::string svg = drawing(curves(), "narrow");
  EXPECT_LT(svg.find("data-curve=\"1\""), svg.find("data-curve=\"0\""));
  EXPECT_THAT(svg, HasSubstr(">ESVR</text>"));
}

TEST(HtmlChart, passesOverWhatCannotBeShown) {
  Plot with = curves();
  with.series[1].points.push_back({3e5, 0.0});
  with.series[1].points.push_back({3e5, std::numeric_limits<double>::quiet_NaN()});
  EXPECT_EQ(count(drawing(with, "wide"), "<circle"), 4u);
  EXPECT_THAT(toHtml(with).markup, Not(HasSubstr("nan")));
}

TEST(HtmlChart, hasASecondScale) {
  Plot with = curves();
  with.rightLabel = "PSNR, dB";
  with.rightTicks = {{1.0, "40"}, {0.1, "60"}, {1e-9, "200"}};
  const std::string svg = drawing(with, "wide");
  EXPECT_THAT(svg, HasSubstr("PSNR, dB"));
  EXPECT_THAT(svg, HasSubstr(">60</text>"));
  EXPECT_THAT(svg, Not(HasSubstr(">200</text>"))) << "beyond the axis";
}

TEST(HtmlChart, keepsItsDrawingWithinItsFrame) {
  const std::string svg = drawing(curves(), "narrow");
  const std::regex number("(?:x|cx|x1|x2)=\"([-0-9.]+)\"");
  for (auto it = std::sregex_iterator(svg.begin(), svg.end(), number); it != std::sregex_iterator();
       ++it) {
    const double x = std::stod((*it)[1]);
    EXPECT_TRUE(x >= 0.0 && x <= 400.0) << (*it)[0];
  }
}

TEST(HtmlChart, isThereWithoutCurves) {
  EXPECT_THAT(toHtml(Plot{.title = "None"}).markup, HasSubstr("</svg>"));
}

}  // namespace
}  // namespace esvr::report
