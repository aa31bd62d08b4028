// Plan: the ends of every interpolation are the given colors, and colors between them follow from
// the definition of the space. Tolerances: conversions are float64, but the matrices of L*a*b* are
// published with four digits, so a color is precise to 1e-3.
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
  // Red has hue 0 and green hue 1/3; yellow is half-way. From red to blue (2/3), the path passes
  // green.
  expectColor(mixed(ColorSpace::kHsv, {1, 0, 0}, {0, 1, 0}, 0.5), {1, 1, 0}, kExact);
  expectColor(mixed(ColorSpace::kHsv, {1, 0, 0}, {0, 0, 1}, 0.5), {0, 1, 0}, kExact);
}

TEST(ColorSpaces, WrappedHsvTakesTheShorterWay) {
  expectColor(mixed(ColorSpace::kHsvWrap, {1, 0, 0}, {0, 0, 1}, 0.5), {1, 0, 1}, kExact);
  expectColor(mixed(ColorSpace::kHsvWrap, {0, 0, 1}, {1, 0, 0}, 0.5), {1, 0, 1}, kExact);
}

TEST(ColorSpaces, LabMixesBlackAndWhiteToTheGreyOfHalfTheLightness) {
  // L* = 50 has Y = ((50 + 16) / 116)^3 = 0.18419, which is 0.4663 on sRGB's curve.
  expectColor(mixed(ColorSpace::kLab, {0, 0, 0}, {1, 1, 1}, 0.5), {0.4663, 0.4663, 0.4663},
              kFourDigits);
}

TEST(ColorSpaces, DivergingPassesThroughMorelandsWhite) {
  // The middle of Moreland's table 2 is (221, 221, 221), which is M = 88 without saturation.
  expectColor(mixed(ColorSpace::kDiverging, kBlue, kRed, 0.5), bytes(221, 221, 221), 1 / 255.0);
}

TEST(ColorSpaces, DivergingFadesAsInMorelandsTable) {
  // Entries 8 and 24, counted from 0, of the 33 entries in Moreland's table. The tolerance is 1/255
  // for his rounding, and as much for the four digits of the conversion, whose errors grow near
  // grey.
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
