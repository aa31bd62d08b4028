// Plan: the ends of every space are the colors given; what lies between follows from the space's
// definition where that can be said in a few numbers. Tolerances: conversions are float64; L*a*b*'s
// matrices are published to four digits, so a color comes back to 1e-3.
#include "render/color_spaces.h"

#include <gtest/gtest.h>

#include "render/expect_color.h"

namespace esvr::test {
namespace {

constexpr double kExact = 1e-12, kFourDigits = 1e-3;
constexpr Rgb kBlue{0.230, 0.299, 0.754}, kRed{0.706, 0.016, 0.150};

TEST(ColorSpaces, BothEndsAreTheColorsGiven) {
  for (const auto space : {ColorSpace::kRgb, ColorSpace::kHsv, ColorSpace::kHsvWrap,
                           ColorSpace::kLab, ColorSpace::kDiverging}) {
    expectColor(mixed(space, kBlue, kRed, 0.0), kBlue, kFourDigits);
    expectColor(mixed(space, kBlue, kRed, 1.0), kRed, kFourDigits);
  }
}

TEST(ColorSpaces, RgbMixesChannels) {
  expectColor(mixed(ColorSpace::kRgb, {0, 0.2, 1}, {1, 0.4, 0}, 0.25), {0.25, 0.25, 0.75}, kExact);
}

TEST(ColorSpaces, HsvPassesThroughTheHuesBetween) {
  // Red has hue 0, green 1/3: half way lies yellow; red to blue (2/3) passes green.
  expectColor(mixed(ColorSpace::kHsv, {1, 0, 0}, {0, 1, 0}, 0.5), {1, 1, 0}, kExact);
  expectColor(mixed(ColorSpace::kHsv, {1, 0, 0}, {0, 0, 1}, 0.5), {0, 1, 0}, kExact);
}

TEST(ColorSpaces, WrappedHsvTakesTheShorterWay) {
  expectColor(mixed(ColorSpace::kHsvWrap, {1, 0, 0}, {0, 0, 1}, 0.5), {1, 0, 1}, kExact);
  expectColor(mixed(ColorSpace::kHsvWrap, {0, 0, 1}, {1, 0, 0}, 0.5), {1, 0, 1}, kExact);
}

TEST(ColorSpaces, LabMixesBlackAndWhiteToTheGreyOfHalfTheLightness) {
  // L* = 50 has Y = ((50 + 16) / 116)^3 = 0.18419, which is 0.4663 under sRGB's curve.
  expectColor(mixed(ColorSpace::kLab, {0, 0, 0}, {1, 1, 1}, 0.5), {0.4663, 0.4663, 0.4663},
              kFourDigits);
}

TEST(ColorSpaces, DivergingPassesThroughMorelandsWhite) {
  // The middle of his table 2, (221, 221, 221), which is M = 88 without saturation.
  expectColor(mixed(ColorSpace::kDiverging, kBlue, kRed, 0.5), bytes(221, 221, 221), 1 / 255.0);
}

TEST(ColorSpaces, DivergingFadesAsInMorelandsTable) {
  // His 33 entries: number 8, counted from 0, and number 24. 1/255 for his rounding, as much again
  // for the four digits of the conversion, which a hue near grey enlarges.
  expectColor(mixed(ColorSpace::kDiverging, kBlue, kRed, 8 / 32.0), bytes(141, 176, 254),
              2 / 255.0);
  expectColor(mixed(ColorSpace::kDiverging, kBlue, kRed, 24 / 32.0), bytes(244, 154, 123),
              2 / 255.0);
}

TEST(ColorSpaces, DivergingBetweenLikeHuesPassesNoWhite) {
  const Rgb middle = mixed(ColorSpace::kDiverging, {0.5, 0, 0}, {1, 0, 0}, 0.5);
  EXPECT_LT(middle.g, 0.1);
  EXPECT_LT(middle.b, 0.1);
}

TEST(ColorSpaces, StepIsTheUpperColor) {
  EXPECT_EQ(mixed(ColorSpace::kStep, kBlue, kRed, 0.01), kRed);
}

}  // namespace
}  // namespace esvr::test
