// Plan: plots are checked as files of both formats and by their pixels: lines are in the right
// places, the same plot gives the same picture, and texts and values that cannot be drawn are left
// out.

#include "report/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "report/png_image.h"

namespace esvr::report {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kPngSignature = "\x89PNG\r\n\x1a\n";

Plot plot() {
  return {.title = "Error over bytes",
          .xLabel = "bytes",
          .yLabel = "PSNR, dB",
          .logarithmicX = true,
          .series = {{"ESVR", {{1e4, 35.0}, {1e5, 45.0}}}, {"ZFP", {{5e4, 30.0}, {2e5, 44.0}}}}};
}

/// Width and height from the header of a PNG file.
std::pair<int, int> sizeOf(const std::string& png) {
  const auto number = [&](std::size_t at) {
    int value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = value * 256 + std::uint8_t(png.at(i));
    return value;
  };
  return {number(16), number(20)};
}

TEST(Plot, isAPngOfItsSize) {
  const std::string png = toPng(plot());
  EXPECT_THAT(png, StartsWith(kPngSignature));
  EXPECT_EQ(sizeOf(png), (std::pair{900, 560}));
}

TEST(Plot, isAnSvgWithItsLines) {
  const std::string svg = toSvg(plot());
  EXPECT_THAT(svg, HasSubstr("<svg "));
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  EXPECT_THAT(svg, HasSubstr("<path "));
}

TEST(Plot, isTheSameForTheSameCurves) {
  EXPECT_TRUE(toPng(plot()) == toPng(plot()));
  Plot other = plot();
  other.series[0].points[1].y = 46.0;
  EXPECT_FALSE(toPng(plot()) == toPng(other));
}

TEST(Plot, passesOverWhatCannotBeDrawn) {
  Plot with = plot();
  with.series[0].points.push_back({2e5, std::numeric_limits<double>::infinity()});
  with.series[1].points.push_back({0.0, 40.0});
  EXPECT_TRUE(toPng(with) == toPng(plot()));
}

TEST(Plot, hasLinesScalesAndLabelsWhereTheyAreAskedFor) {
  const std::string plain = toPng(plot());
  Plot thick = plot(), loose = plot(), scaled = plot(), labelled = plot();
  thick.series[0].emphasis = Emphasis::kOurs;
  loose.series[0].joined = false;
  scaled.rightTicks = {{40.0, "1 %"}};
  labelled.textX = [](double) { return std::string("x"); };
  for (const Plot& other : {thick, loose, scaled, labelled}) EXPECT_FALSE(toPng(other) == plain);
  Plot beyond = scaled;
  beyond.rightTicks.push_back({1e9, "beyond the axis"});
  EXPECT_TRUE(toPng(beyond) == toPng(scaled));
}

TEST(Plot, isThereWithoutCurvesAndWithAnyText) {
  EXPECT_THAT(toPng({.title = "\xff<&>\x1b"}), StartsWith(kPngSignature));
  EXPECT_THAT(toSvg({.title = "\xff<&>\x1b", .series = {{"\xff", {}}}}), HasSubstr("</svg>"));
}

TEST(PngImage, hasThePicturesSize) {
  const Image image{3, 2, std::vector<float>(24, 0.5f)};
  EXPECT_EQ(sizeOf(toPng(image)), (std::pair{3, 2}));
}

}  // namespace
}  // namespace esvr::report
