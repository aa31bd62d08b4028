// Plan: bars of known colors are drawn into pictures of many sizes. The tests look for the colors
// in the columns of the bar, and check that nothing outside the right edge changes, that the size
// of the bar follows the height of the picture, and that any text and any range can be drawn.

#include "programs/pictures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace esvr::report {
namespace {

/// Red at low values and blue at high ones; low values are transparent.
ColorBar redAndBlue() {
  return {.name = "density", .unit = "kg/m\u00b3", .shades = {{{1, 0, 0}, 0.0}, {{0, 0, 1}, 1.0}}};
}

Image transparent(int width, int height) {
  return {width, height, std::vector<float>(std::size_t(width) * std::size_t(height) * 4)};
}

using Pixel = std::array<float, 4>;
Pixel at(const Image& image, int x, int y) {
  const float* p = &image.rgba[4 * (std::size_t(y) * std::size_t(image.width) + std::size_t(x))];
  return {p[0], p[1], p[2], p[3]};
}
const Pixel kRed{1, 0, 0, 1}, kBlue{0, 0, 1, 1};

/// Number of the pixels of a row that have a color.
int countInRow(const Image& image, int y, const Pixel& color) {
  int count = 0;
  for (int x = 0; x < image.width; ++x) count += at(image, x, y) == color;
  return count;
}

TEST(ColorBar, hasItsColorsWithAndWithoutTheirOpacity) {
  Image image = transparent(400, 400);
  drawColorBar(redAndBlue(), image);
  // Blue is opaque in both columns. Red is shown in the column of colors only.
  const int blue = countInRow(image, 150, kBlue), red = countInRow(image, 250, kRed);
  EXPECT_GT(red, 5);
  EXPECT_GT(blue, red + 3);
  EXPECT_EQ(countInRow(image, 150, kRed), 0);
  EXPECT_EQ(countInRow(image, 250, kBlue), 0);
}

TEST(ColorBar, changesTheRightEdgeOnly) {
  const ColorBar bar = redAndBlue();
  Image image = transparent(300, 200);
  drawColorBar(bar, image);
  const int left = int(300 * (1.0 - colorBarShare(bar, 300, 200))) - 1;
  bool changed = false;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const bool same = at(image, x, y) == Pixel{};
      ASSERT_TRUE(same || x >= left) << x << ", " << y;
      changed |= !same;
    }
  EXPECT_TRUE(changed);
}

TEST(ColorBar, isAsLargeAsThePictureDemands) {
  const ColorBar bar = redAndBlue();
  const double share = colorBarShare(bar, 800, 800);
  EXPECT_LT(share, 0.25);
  EXPECT_NEAR(colorBarShare(bar, 8000, 8000), share, 0.01);
  EXPECT_NEAR(colorBarShare(bar, 1600, 800), share / 2, 0.01);
  EXPECT_LE(colorBarShare(bar, 100, 2000), kMaxBarShare);
}

TEST(ColorBar, leavesIllegibleTextsOut) {
  ColorBar bar = redAndBlue(), other = bar;
  other.name = "ytisned";  // has the same width
  const auto drawn = [](const ColorBar& b, int side) {
    Image image = transparent(side, side);
    drawColorBar(b, image);
    return image.rgba;
  };
  EXPECT_NE(drawn(bar, 400), drawn(other, 400));
  EXPECT_EQ(drawn(bar, 100), drawn(other, 100));
}

TEST(ColorBar, fitsIntoAnyPicture) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 1}, {1, 300}, {300, 1}, {16, 16}, {64, 48}, {7, 999}, {999, 7}}) {
    Image image = transparent(width, height);
    EXPECT_NO_THROW(drawColorBar(redAndBlue(), image)) << width << " x " << height;
    for (const float value : image.rgba) ASSERT_TRUE(value >= 0.0f && value <= 1.0f);
  }
}

TEST(ColorBar, takesAnyTextAndRange) {
  const std::string longName(500, 'x'), notUtf8 = "\xff\n\x1b\xe2\x82";
  constexpr double kHuge = std::numeric_limits<double>::max();
  for (const std::string& text : {longName, notUtf8, std::string()})
    for (const auto& [low, high] :
         {std::pair{0.0, 0.0}, {5.0, 5.0}, {-kHuge, kHuge}, {1e-30, 2e-30}}) {
      Image image = transparent(200, 200);
      const ColorBar bar{.name = text, .unit = text, .low = low, .high = high};
      EXPECT_NO_THROW(drawColorBar(bar, image));
      EXPECT_LE(colorBarShare(bar, 200, 200), kMaxBarShare);
    }
}

TEST(ColorBar, hasInkThatContrastsWithTheBackground) {
  const auto darkest = [](const std::array<double, 3>& background) {
    ColorBar bar = redAndBlue();
    bar.background = background;
    Image image = transparent(400, 400);
    for (std::size_t i = 0; i < image.rgba.size(); ++i)
      image.rgba[i] = i % 4 == 3 ? 1.0f : float(background[i % 4]);
    drawColorBar(bar, image);
    float least = 1.0f, most = 0.0f;
    for (int y = 0; y < 80; ++y)  // above the bar
      for (int x = 250; x < 400; ++x) {
        least = std::min(least, at(image, x, y)[1]);
        most = std::max(most, at(image, x, y)[1]);
      }
    return std::pair{least, most};
  };
  EXPECT_LT(darkest({1, 1, 1}).first, 0.4f);
  EXPECT_GT(darkest({0, 0, 0}).second, 0.6f);
}

using Labels = std::vector<std::string>;

Labels roundLabels(double low, double high, double most) {
  Labels texts;
  for (const Tick& tick : roundTicks(low, high, most)) texts.push_back(tick.label);
  return texts;
}

TEST(RoundTicks, includeTheEndsThatAreRound) {
  EXPECT_EQ(roundLabels(0.0, 1.0, 5.0), (Labels{"0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_EQ(roundLabels(-3.0, 3.0, 7.0), (Labels{"-3", "-2", "-1", "0", "1", "2", "3"}));
  EXPECT_EQ(roundLabels(double(0.1f), double(0.3f), 4.0),
            (Labels{"0.10", "0.15", "0.20", "0.25", "0.30"}));
}

TEST(RoundTicks, canBeDistinguishedInNarrowRanges) {
  EXPECT_EQ(roundLabels(1000.0001, 1000.0009, 4.0),
            (Labels{"1.0000002e+03", "1.0000004e+03", "1.0000006e+03", "1.0000008e+03"}));
  EXPECT_EQ(roundLabels(0.0, 5e-6, 5.0),
            (Labels{"0", "1e-06", "2e-06", "3e-06", "4e-06", "5e-06"}));
  EXPECT_EQ(roundLabels(0.0, 3e7, 3.0), (Labels{"0", "1e+07", "2e+07", "3e+07"}));
}

TEST(RoundTicks, areThereForAnyRange) {
  EXPECT_EQ(roundLabels(0.25, 0.25, 5.0), (Labels{"0.25"}));
  EXPECT_EQ(roundTicks(1.0, std::nextafter(1.0, 2.0), 5.0).size(), 1u)
      << "no room for round numbers";
  EXPECT_EQ(roundTicks(-1.7e308, 1.7e308, 5.0).size(), 1u) << "the range is not finite";
}

}  // namespace
}  // namespace esvr::report
