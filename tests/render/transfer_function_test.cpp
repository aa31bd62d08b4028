// Plan: curves follow their definition at ends, midpoints and beyond. The ends of every
// interpolation of colors are the given colors, and colors between them follow from the definition
// of the space; conversions are float64, but the matrices of L*a*b* are published with four digits,
// so a color is precise to 1e-3. Built-in maps agree with entries of the published tables of 256
// colors that are not in the library's tables. Linear interpolation between every fifth entry is
// within 2/255 of all 256 entries, and rounding adds half a level.
//
// A preset as ParaView writes it is read point by point. Other files are refused with their
// name and the reason.
//
// The light of segments of random values agrees with sums over 4000 places in float64, for
// curves with ramps, steps, plateaus of no opacity and of full opacity. In the sums each place
// absorbs the light of those behind it; the table does so in pieces with an extinction of up to
// 1/4, within which it is neglected. That moves a color by up to 1/48 of its change along the
// segment and leaves the opacity unchanged. Opacities err by less than 1e-4 (transfer_table.h), and
// by as much again where an opacity of 1 is approached within one interval of the table. At a step
// inside an interval, extinction may be off by 1/8 interval.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/transfer_function.h"
#include "esvr/volume.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/transfer_table.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

// Functions.

constexpr double kExactColor = 1e-12, kFourDigits = 1e-3, kTable = 2.5 / 255.0;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void expectColor(const Rgb& actual, const Rgb& expected, double tolerance) {
  EXPECT_NEAR(actual.r, expected.r, tolerance);
  EXPECT_NEAR(actual.g, expected.g, tolerance);
  EXPECT_NEAR(actual.b, expected.b, tolerance);
}

/// The color of three bytes.
Rgb bytes(int r, int g, int b) { return {r / 255.0, g / 255.0, b / 255.0}; }

TEST(ColorMap, BeyondThePointsAreTheColorsOfTheEnds) {
  const ColorMap map = builtInColorMap("black-body");
  EXPECT_EQ(colorAt(map, -7.0), (Rgb{0, 0, 0}));
  EXPECT_EQ(colorAt(map, 7.0), (Rgb{1, 1, 1}));
  EXPECT_EQ(colorAt(map, std::numeric_limits<double>::infinity()), (Rgb{1, 1, 1}));
}

TEST(ColorMap, NotANumberHasItsOwnColor) {
  ColorMap map = builtInColorMap("viridis");
  map.nan = {1, 0, 1};
  EXPECT_EQ(colorAt(map, kNan), (Rgb{1, 0, 1}));
}

TEST(ColorMap, OnePointColorsEverything) {
  const ColorMap map{ColorSpace::kRgb, {{3.0, {0.1, 0.2, 0.3}}}, {}};
  for (const double x : {-1.0, 3.0, 9.0}) EXPECT_EQ(colorAt(map, x), (Rgb{0.1, 0.2, 0.3}));
}

TEST(ColorMap, TwoPointsAtOnePlaceAreAJump) {
  const ColorMap map{
      ColorSpace::kRgb, {{0, {0, 0, 0}}, {1, {0, 0, 0}}, {1, {1, 1, 1}}, {2, {1, 1, 1}}}, {}};
  EXPECT_EQ(colorAt(map, 0.999), (Rgb{0, 0, 0}));
  EXPECT_EQ(colorAt(map, 1.0), (Rgb{1, 1, 1}));
}

struct Entry {
  const char* map;
  int place;  // index, 0 to 255
  Rgb color;
};

TEST(ColorMap, BuiltInMapsFollowThePublishedTables) {
  const Entry entries[] = {
      {"viridis", 0, bytes(68, 1, 84)},      {"viridis", 37, bytes(70, 51, 127)},
      {"viridis", 128, bytes(33, 145, 140)}, {"viridis", 203, bytes(119, 209, 83)},
      {"magma", 37, bytes(36, 18, 83)},      {"magma", 128, bytes(183, 55, 121)},
      {"inferno", 203, bytes(252, 163, 9)},  {"inferno", 255, bytes(252, 255, 164)},
      {"plasma", 37, bytes(85, 2, 164)},     {"plasma", 128, bytes(204, 71, 120)},
      {"cividis", 37, bytes(24, 58, 109)},   {"cividis", 203, bytes(201, 185, 106)},
      {"turbo", 37, bytes(63, 120, 246)},    {"turbo", 203, bytes(247, 97, 24)}};
  for (const Entry& e : entries) {
    SCOPED_TRACE(std::string(e.map) + " " + std::to_string(e.place));
    expectColor(colorAt(builtInColorMap(e.map), e.place / 255.0), e.color, kTable);
  }
}

TEST(ColorMap, EveryBuiltInMapIsWellFormed) {
  for (const auto& name : builtInColorMaps())
    for (const auto& opacity : builtInOpacities())
      EXPECT_NO_THROW(checkTransferFunction({builtInColorMap(name), builtInOpacity(opacity)}));
  EXPECT_EQ(builtInColorMaps().size(), 13u);
}

TEST(ColorMap, AnUnknownNameListsThoseThereAre) {
  try {
    (void)builtInColorMap("jet");
    FAIL() << "accepted";
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("cool-to-warm"), std::string::npos);
  }
  EXPECT_THROW((void)builtInOpacity("cubic"), UsageError);
}

TEST(OpacityCurve, BuiltInShapes) {
  const double at[] = {0.0, 0.25, 0.49, 0.51, 0.75, 1.0};
  const double linear[] = {0.0, 0.25, 0.49, 0.51, 0.75, 1.0};
  const double tent[] = {0.0, 0.5, 0.98, 0.98, 0.5, 0.0};
  const double step[] = {0.0, 0.0, 0.0, 1.0, 1.0, 1.0};
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(opacityAt(builtInOpacity("linear"), at[i]), linear[i], kExactColor);
    EXPECT_NEAR(opacityAt(builtInOpacity("inverse"), at[i]), 1.0 - linear[i], kExactColor);
    EXPECT_NEAR(opacityAt(builtInOpacity("tent"), at[i]), tent[i], kExactColor);
    EXPECT_NEAR(opacityAt(builtInOpacity("step"), at[i]), step[i], kExactColor);
  }
}

TEST(OpacityCurve, TheMidpointHasHalfOfTheChange) {
  for (const double sharpness : {0.0, 0.3, 0.7}) {
    const OpacityCurve curve{{0.0, 0.2, 0.8, sharpness}, {1.0, 0.6}};
    EXPECT_NEAR(opacityAt(curve, 0.8), 0.4, kExactColor);
    EXPECT_NEAR(opacityAt(curve, 0.0), 0.2, kExactColor);
    EXPECT_NEAR(opacityAt(curve, 1.0), 0.6, kExactColor);
  }
}

TEST(OpacityCurve, SharpnessDrawsTheCurveToItsEnds) {
  // By the formula, s = 0.25 becomes 0.5 * 0.5^6 = 1/128 for sharpness 0.5. The Hermite curve with
  // tangents 0.5 is then 3 s^2 - 2 s^3 + 0.5 (2 s^3 - 3 s^2 + s).
  const OpacityCurve curve{{0.0, 0.0, 0.5, 0.5}, {1.0, 1.0}};
  const double s = 1.0 / 128, s2 = s * s, s3 = s2 * s;
  EXPECT_NEAR(opacityAt(curve, 0.25), 3 * s2 - 2 * s3 + 0.5 * (2 * s3 - 3 * s2 + s), kExactColor);
}

TEST(OpacityCurve, MidpointsAtTheEndsOfASegmentAreNoDivisionByZero) {
  for (const double midpoint : {0.0, 1.0})
    for (const double x : {0.0, 0.5, 1.0}) {
      const double y = opacityAt({{0.0, 0.0, midpoint, 0.0}, {1.0, 1.0}}, x);
      EXPECT_TRUE(y >= 0.0 && y <= 1.0) << midpoint << " " << x;
    }
}

TEST(TransferFunction, RescalingMovesColorsAndOpacitiesIntoTheRange) {
  const auto f = rescaled({builtInColorMap("grayscale"), builtInOpacity("tent")}, {-2.0f, 6.0f});
  expectColor(colorAt(f.colors, 0.0), {0.25, 0.25, 0.25}, kExactColor);
  EXPECT_NEAR(opacityAt(f.opacity, 2.0), 1.0, kExactColor);
  EXPECT_NEAR(opacityAt(f.opacity, 6.0), 0.0, kExactColor);
}

TEST(TransferFunction, ARangeWithoutExtentShowsTheUpperEnd) {
  const auto f = rescaled({builtInColorMap("grayscale"), builtInOpacity("linear")}, {3.0f, 3.0f});
  EXPECT_EQ(opacityAt(f.opacity, 3.0), 1.0);
  EXPECT_EQ(opacityAt(f.opacity, 2.9), 0.0);
  EXPECT_EQ(colorAt(f.colors, 3.0), (Rgb{1, 1, 1}));
}

TEST(TransferFunction, ALevelSetIsOpaqueInsideAndDarkInAThinLayerBeforeIt) {
  const TransferFunction f = levelSetSurface(3.0);
  EXPECT_NO_THROW(checkTransferFunction(f));
  EXPECT_EQ(opacityAt(f.opacity, -1e-9), 1.0);
  EXPECT_LT(opacityAt(f.opacity, 1e-9), 0.5);
  EXPECT_EQ(opacityAt(f.opacity, 3.0), 0.0) << "the background";
  EXPECT_LT(colorAt(f.colors, 1e-9).g, colorAt(f.colors, -1e-9).g);
  EXPECT_THROW((void)levelSetSurface(0.0), UsageError);
}

// The usual look.

TEST(UsualLook, IsALineUnlessTheLargestValueIsFarAboveTheOthers) {
  const LookBasis smoke{.range = {0.25f, 2.0f}};
  const OpacityCurve line = rescaled({{}, builtInOpacity("linear")}, {0.0f, 2.0f}).opacity;
  EXPECT_EQ(usualOpacity(smoke), line);
  LookBasis deep = smoke;
  deep.medianDepth = 20.0;
  EXPECT_EQ(usualOpacity(deep), line);
  deep.medianDepth = 2.0 * std::log(2.0);  // half of the light passes by the line, too
  EXPECT_EQ(usualOpacity(deep), line);
  const TransferFunction look = usualLook(smoke, "inferno");
  EXPECT_EQ(look.colors, rescaled({builtInColorMap("inferno"), {}}, {0.0f, 2.0f}).colors);
}

/// Smoke with a spark: a column of 50 voxels of 0.02 lets half of the light through.
TEST(UsualLook, ShowsFaintSmokeBesideASpark) {
  constexpr double kFaint = 0.02, kVoxels = 50.0;
  const LookBasis smoke{.range = {0.001f, 1000.0f}, .medianDepth = kFaint * kVoxels};
  const TransferFunction look = usualLook(smoke);
  ASSERT_NO_THROW(checkTransferFunction(look));
  EXPECT_LE(look.opacity.size(), 12u) << "a curve that can be edited";
  const auto light = [&](double value) {
    return std::pow(1.0 - opacityAt(look.opacity, value), kVoxels);
  };
  EXPECT_NEAR(light(kFaint), 0.5, 0.01);
  EXPECT_EQ(opacityAt(look.opacity, 0.0), 0.0);
  EXPECT_EQ(opacityAt(look.opacity, 1000.0), 1.0);
  for (double value = 1e-4; value < 1000.0; value *= 1.5)
    EXPECT_GE(opacityAt(look.opacity, value), value / 1000.0) << value;
}

TEST(UsualLook, TakesAnyDepth) {
  for (const double depth : {1e-320, 1e-45, 1e-6, 1.0, 1e44})
    for (const float high : {1e-45f, 1e-20f, 1.0f, 3e38f}) {
      const TransferFunction look = usualLook({.range = {0.0f, high}, .medianDepth = depth});
      EXPECT_NO_THROW(checkTransferFunction(look)) << depth << ", " << high;
    }
}

TEST(UsualLook, OfALevelSetIsItsSurface) {
  EXPECT_EQ(usualLook({.range = {-3.0f, 3.0f}, .background = 3.0f, .isLevelSet = true}),
            levelSetSurface(3.0));
}

TEST(UsualLook, LooksThroughFogVolumesOnly) {
  GridDescriptor grid;
  const SparseVolume volume =
      makeVolume({{.corner = {8, 0, 0}, .values = {0.0f, 4.0f}, .active = {{3}}}}, 0.0f);
  grid.gridClass = GridClass::kFogVolume;
  const LookBasis fog = lookBasis(grid, volume);
  EXPECT_EQ(fog.medianDepth, 4.0);
  EXPECT_EQ(fog.range.max, 4.0f);
  grid.gridClass = GridClass::kUnknown;
  EXPECT_FALSE(lookBasis(grid, volume).medianDepth);
}

TEST(TransferFunction, WhatMakesNoSenseIsRefused) {
  const auto good = TransferFunction{builtInColorMap("viridis"), builtInOpacity("linear")};
  const auto refused = [&](auto&& spoil) {
    TransferFunction f = good;
    spoil(f);
    EXPECT_THROW(checkTransferFunction(f), UsageError);
  };
  refused([](auto& f) { f.colors.points.clear(); });
  refused([](auto& f) { f.opacity.clear(); });
  refused([](auto& f) { f.opacity[0].opacity = 1.5; });
  refused([](auto& f) { f.opacity[0].opacity = kNan; });
  refused([](auto& f) { f.opacity[0].midpoint = -0.1; });
  refused([](auto& f) { f.opacity[0].x = 2.0; });
  refused([](auto& f) { f.colors.points[3].x = kNan; });
  refused([](auto& f) { f.colors.points[3].color.g = -1.0; });
}

constexpr Rgb kBlue{0.230, 0.299, 0.754}, kRed{0.706, 0.016, 0.150};

/// A color between two points of a map.
Rgb mixed(ColorSpace space, const Rgb& a, const Rgb& b, double s) {
  return colorAt({space, {{0.0, a}, {1.0, b}}, {}}, s);
}

TEST(ColorSpaces, BothEndsAreTheColorsGiven) {
  constexpr double kAlmost = 1e-9;  // at the points themselves, nothing is mixed
  for (const auto space : {ColorSpace::kRgb, ColorSpace::kHsv, ColorSpace::kHsvWrap,
                           ColorSpace::kLab, ColorSpace::kDiverging}) {
    expectColor(mixed(space, kBlue, kRed, kAlmost), kBlue, kFourDigits);
    expectColor(mixed(space, kBlue, kRed, 1.0 - kAlmost), kRed, kFourDigits);
  }
}

TEST(ColorSpaces, RgbMixesChannels) {
  expectColor(mixed(ColorSpace::kRgb, {0, 0.2, 1}, {1, 0.4, 0}, 0.25), {0.25, 0.25, 0.75},
              kExactColor);
}

TEST(ColorSpaces, HsvPassesThroughTheHuesBetween) {
  // Red has hue 0 and green hue 1/3; yellow is half-way. From red to blue (2/3), the path passes
  // green.
  expectColor(mixed(ColorSpace::kHsv, {1, 0, 0}, {0, 1, 0}, 0.5), {1, 1, 0}, kExactColor);
  expectColor(mixed(ColorSpace::kHsv, {1, 0, 0}, {0, 0, 1}, 0.5), {0, 1, 0}, kExactColor);
}

TEST(ColorSpaces, WrappedHsvTakesTheShorterWay) {
  expectColor(mixed(ColorSpace::kHsvWrap, {1, 0, 0}, {0, 0, 1}, 0.5), {1, 0, 1}, kExactColor);
  expectColor(mixed(ColorSpace::kHsvWrap, {0, 0, 1}, {1, 0, 0}, 0.5), {1, 0, 1}, kExactColor);
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

// ParaView's presets.

constexpr const char* kTwoPresets = R"([
  {"ColorSpace": "Diverging", "Name": "first", "NanColor": [0, 1, 0],
   "RGBPoints": [0, 0.25, 0.5, 0.75, 10, 1, 0, 0],
   "Points": [10, 0.5, 0.5, 0, 0, 0, 0.25, 0.75]},
  {"ColorSpace": "Step", "Name": "second", "RGBPoints": [2, 0, 0, 0, -1, 1, 1, 1]}
])";

class ParaViewPreset : public testing::Test {
 protected:
  TransferFunction read(const std::string& text, const std::string& name = {}) {
    writeText(folder_ / "p.json", text);
    return readParaViewPreset(folder_ / "p.json", name);
  }
  std::string refusal(const std::string& text, const std::string& name = {}) {
    try {
      (void)read(text, name);
    } catch (const BadInput& error) {
      return error.what();
    }
    return "accepted";
  }
  TemporaryFolder folder_;
};

TEST_F(ParaViewPreset, ComesBackPointByPoint) {
  const auto f = read(kTwoPresets);
  EXPECT_EQ(f.colors.space, ColorSpace::kDiverging);
  EXPECT_EQ(f.colors.nan, (Rgb{0, 1, 0}));
  ASSERT_EQ(f.colors.points.size(), 2u);
  EXPECT_EQ(f.colors.points[0].color, (Rgb{0.25, 0.5, 0.75}));
  EXPECT_EQ(f.colors.points[1].x, 10.0);
  ASSERT_EQ(f.opacity.size(), 2u);
  EXPECT_EQ(f.opacity[0].midpoint, 0.25);  // the file has the opposite order
  EXPECT_EQ(f.opacity[0].sharpness, 0.75);
  EXPECT_EQ(f.opacity[1].opacity, 0.5);
}

TEST_F(ParaViewPreset, IsFoundByName) {
  const auto f = read(kTwoPresets, "second");
  EXPECT_EQ(f.colors.space, ColorSpace::kStep);
  EXPECT_EQ(f.colors.points[0].x, -1.0);
}

TEST_F(ParaViewPreset, WithoutOpacitiesIsLinearOverItsColors) {
  const auto f = read(kTwoPresets, "second");
  EXPECT_EQ(opacityAt(f.opacity, -1.0), 0.0);
  EXPECT_DOUBLE_EQ(opacityAt(f.opacity, 0.5), 0.5);
  EXPECT_EQ(opacityAt(f.opacity, 2.0), 1.0);
}

TEST_F(ParaViewPreset, MayBeOneObjectWithoutAnArray) {
  EXPECT_EQ(read(R"({"RGBPoints": [0, 1, 1, 1]})").colors.points.size(), 1u);
}

TEST_F(ParaViewPreset, WrapsTheHueWhereItSaysSo) {
  EXPECT_EQ(read(R"({"ColorSpace": "HSV", "RGBPoints": [0, 1, 1, 1]})").colors.space,
            ColorSpace::kHsv);
  for (const char* yes : {"true", "1"})
    EXPECT_EQ(read(std::string(R"({"ColorSpace": "HSV", "HSVWrap": )") + yes +
                   R"(, "RGBPoints": [0, 1, 1, 1]})")
                  .colors.space,
              ColorSpace::kHsvWrap);
}

TEST_F(ParaViewPreset, AMissingNameListsThoseThereAre) {
  EXPECT_THAT(refusal(kTwoPresets, "third"), HasSubstr("\"first\", \"second\""));
}

TEST_F(ParaViewPreset, WhatIsNoPresetIsRefusedWithItsReason) {
  EXPECT_THAT(refusal("{"), HasSubstr("p.json: not JSON"));
  EXPECT_THAT(refusal("[]"), HasSubstr("there are none"));
  EXPECT_THAT(refusal("3"), HasSubstr("there are none"));
  EXPECT_THAT(refusal(R"({"RGBPoints": []})"), HasSubstr("RGBPoints"));
  EXPECT_THAT(refusal(R"({"RGBPoints": [0, 1, 1]})"), HasSubstr("4 a point"));
  EXPECT_THAT(refusal(R"({"RGBPoints": [0, 1, 1, "x"]})"), HasSubstr("numbers"));
  EXPECT_THAT(refusal(R"({"RGBPoints": [0, 1, 1, 2]})"), HasSubstr("outside 0 to 1"));
  EXPECT_THAT(refusal(R"({"RGBPoints": [0, 1, 1, 1], "Points": [0, 2, 0.5, 0]})"),
              HasSubstr("opacity"));
  EXPECT_THAT(refusal(R"({"RGBPoints": [0, 1, 1, 1], "NanColor": [0, 1]})"), HasSubstr("NanColor"));
  EXPECT_THAT(refusal(R"({"RGBPoints": [0, 1, 1, 1], "ColorSpace": "CMYK"})"), HasSubstr("CMYK"));
  EXPECT_THROW((void)readParaViewPreset(folder_ / "none.json"), BadInput);
}

constexpr const char* kOldMaps = R"(<?xml version="1.0"?>
<ColorMaps>
  <ColorMap name="plain" space="Lab">
    <Point x="0" o="1" r="0" g="0.5" b="1"/><Point x="4" o="1" r="1" g="1" b="0"/>
    <NaN r="0.25" g="0" b="0"/>
  </ColorMap>
  <ColorMap name="veil" space="Wrapped">
    <Point x="2" o="0.75" r="1" g="0" b="0"/><Point x="-2" o="0" r="0" g="0" b="1"/>
  </ColorMap>
</ColorMaps>)";

TEST_F(ParaViewPreset, InTheOlderXmlIsRead) {
  const auto f = read(kOldMaps);
  EXPECT_EQ(f.colors.space, ColorSpace::kLab);
  EXPECT_EQ(f.colors.nan, (Rgb{0.25, 0, 0}));
  ASSERT_EQ(f.colors.points.size(), 2u);
  EXPECT_EQ(f.colors.points[1], (ColorPoint{4.0, {1, 1, 0}}));
  EXPECT_EQ(opacityAt(f.opacity, 1.0), 0.25) << "linear: a map of colors only";
  const auto veil = read(kOldMaps, "veil");
  EXPECT_EQ(veil.colors.space, ColorSpace::kHsvWrap);
  EXPECT_EQ(veil.colors.points[0].x, -2.0);
  EXPECT_EQ(opacityAt(veil.opacity, 0.0), 0.375);
}

std::string utf16(const std::string& text, bool bigEndian) {
  std::string units = bigEndian ? "\xfe\xff" : "\xff\xfe";
  for (const char c : text) units += bigEndian ? std::string{'\0', c} : std::string{c, '\0'};
  return units;
}

TEST_F(ParaViewPreset, OfWindowsIsRead) {
  const auto expected = read(kOldMaps);
  EXPECT_EQ(read(std::string("\xef\xbb\xbf") + kOldMaps), expected);
  EXPECT_EQ(read(utf16(kOldMaps, false)), expected);
  EXPECT_EQ(read(utf16(kOldMaps, true)), expected);
  EXPECT_EQ(read(std::string("\xef\xbb\xbf") + kTwoPresets, "first"), read(kTwoPresets, "first"));
}

TEST_F(ParaViewPreset, WithWhatParaViewWritesIsRead) {
  const auto f = read(R"(// a comment
{"Name": "a", "ColorSpace": "Lab/CIEDE2000", "Points": null, "NanColor": null,
 "RGBPoints": [0, 0, 0, 1.0000000001, 1, -1e-9, 1, 0]})");
  EXPECT_EQ(f.colors.space, ColorSpace::kLab);
  EXPECT_EQ(f.colors.points[0].color, (Rgb{0, 0, 1}));
  EXPECT_EQ(f.colors.points[1].color, (Rgb{0, 1, 0}));
  EXPECT_THAT(refusal(R"({"RGBPoints": [0, 0, 0, 1.01, 1, 0, 1, 0]})"), HasSubstr("p.json"));
}

TEST_F(ParaViewPreset, InDamagedXmlIsRefused) {
  EXPECT_THAT(refusal("<ColorMap><Point"), HasSubstr("p.json: not XML"));
  EXPECT_THAT(refusal("<ColorMap><Point x='a' r='0' g='0' b='0'/></ColorMap>"),
              HasSubstr("not a color map"));
  EXPECT_THAT(refusal("<ColorMap name='n'/>"), HasSubstr("no preset"));
}

TEST_F(ParaViewPreset, WrittenComesBackAsItWas) {
  for (const char* name : {"first", "second"}) {
    const auto f = read(kTwoPresets, name);
    EXPECT_EQ(read(paraViewPreset(f, "again"), "again"), f);
  }
  const auto wrapped = read(kOldMaps, "veil");
  EXPECT_EQ(read(paraViewPreset(wrapped, "")), wrapped);
}

// ---- The table

constexpr int kPlaces = 4000;
constexpr double kOpacity = 2e-4, kColor = 1.0 / 48.0;
/// The light of a segment by the table of a function.
class SegmentTable {
 public:
  SegmentTable(const TransferFunction& f, double length) : table_(f, {length, true}) {}
  PixelColor operator()(float a, float b) const { return table_.view().segments(a, b); }

 private:
  TransferTable table_;
};

PixelColor summed(const TransferFunction& f, double length, double a, double b) {
  double color[3] = {}, left = 1.0;
  for (int i = 0; i < kPlaces; ++i) {
    const Channels at = channelsAt(f, a + (b - a) * (i + 0.5) / kPlaces, length);
    if (!(at[3] > 0.0)) continue;
    const double alpha = -std::expm1(-at[3] / kPlaces);
    for (std::size_t c = 0; c < 3; ++c) color[c] += left * alpha * at[c] / at[3];
    left *= 1.0 - alpha;
  }
  return {float(color[0]), float(color[1]), float(color[2]), float(1.0 - left)};
}

void expectLight(const PixelColor& actual, const PixelColor& expected, double opacity = kOpacity) {
  EXPECT_NEAR(actual.alpha, expected.alpha, opacity);
  EXPECT_NEAR(actual.r, expected.r, kColor);
  EXPECT_NEAR(actual.g, expected.g, kColor);
  EXPECT_NEAR(actual.b, expected.b, kColor);
}

TransferFunction withOpacity(OpacityCurve curve) { return {builtInColorMap("viridis"), curve}; }

void expectSums(const TransferFunction& f, double length, double opacity = kOpacity) {
  const SegmentTable table(f, length);
  Random random(7);
  for (int i = 0; i < 40; ++i) {
    const float a = float(random(-0.3, 1.3)), b = float(random(-0.3, 1.3));
    SCOPED_TRACE(std::to_string(a) + " to " + std::to_string(b));
    expectLight(table(a, b), summed(f, length, a, b), opacity);
  }
}

TEST(SegmentTable, HoldsTheIntegralsOfRampsAndPlateaus) {
  for (const double length : {0.05, 0.3, 2.0}) {
    for (const char* name : {"inverse", "tent", "smoke", "ct-bone"})
      expectSums(withOpacity(builtInOpacity(name)), length);
    expectSums(withOpacity({{0.0, 0.0}, {0.25, 0.0}, {0.5, 0.9}, {0.75, 0.0}, {1.0, 0.0}}), length);
  }
}

TEST(SegmentTable, HoldsTheIntegralsOfSteps) {
  expectSums(withOpacity({{0.0, 0.1}, {0.5, 0.1}, {0.5, 0.7}, {1.0, 0.7}}), 0.5);
  expectSums(withOpacity({{0.0, 0.0}, {0.3, 0.0}, {0.3, 0.5}, {1.0, 0.0}}), 1.0, 1e-3);
}

TEST(SegmentTable, FullOpacityIsOpaque) {
  for (const double length : {1e-3, 1.0, 50.0}) {
    const SegmentTable table(withOpacity({{0.0, 0.0}, {0.5, 0.0}, {0.5, 1.0}, {1.0, 1.0}}), length);
    EXPECT_EQ(table(0.6f, 0.9f).alpha, 1.0f);
    EXPECT_EQ(table(0.8f, 0.8f).alpha, 1.0f);
    EXPECT_EQ(table(3.0f, 1.0f).alpha, 1.0f);
    EXPECT_NEAR(table(0.26f, 0.6f).alpha, 1.0f, 1e-6f) << "more than a quarter is opaque";
    EXPECT_EQ(table(-0.4f, 0.49f).alpha, 0.0f);
  }
}

TEST(SegmentTable, FogIsPreciseBesideFullOpacity) {
  // Of 32-bit floats, the integral up to the fog would leave no digits of the fog's.
  const SegmentTable table(withOpacity({{0.0, 1.0}, {0.5, 1.0}, {0.5, 0.001}, {1.0, 0.001}}), 1.0);
  for (const float apart : {0.0f, 1e-6f, 1e-4f, 5e-4f, 1e-3f, 0.1f})
    EXPECT_NEAR(table(0.8f, 0.8f + apart).alpha, 0.001, 3e-5) << apart;
}

TEST(SegmentTable, CloseValuesHaveThePointsOwnLight) {
  const TransferFunction f = withOpacity(builtInOpacity("smoke"));
  const SegmentTable table(f, 1.0);
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const float a = float(random(0.0, 1.0)), b = a + float(random(-1e-4, 1e-4));
    expectLight(table(a, b), summed(f, 1.0, a, a), 3e-4);
    expectLight(table(a, std::nextafter(a, 2.0f)), table(a, a), 1e-5);
  }
}

TEST(SegmentTable, ValuesBeyondTheFunctionHaveItsEnds) {
  const SegmentTable table(withOpacity({{0.0, 0.25}, {1.0, 0.75}}), 1.0);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(table(-kInfinity, -5.0f).alpha, 0.25, 1e-5);
  EXPECT_NEAR(table(2.0f, kInfinity).alpha, 0.75, 1e-5);
  EXPECT_NEAR(table(-kInfinity, kInfinity).alpha, 1.0 - std::sqrt(0.75 * 0.25), 1e-4);
}

TEST(SegmentTable, AFunctionWithoutExtentIsAStep) {
  const SegmentTable table({{ColorSpace::kRgb, {{3.0, {1, 0, 0}}}, {}}, {{3.0, 0.0}, {3.0, 0.5}}},
                           1.0);
  EXPECT_EQ(table(1.0f, 2.999f).alpha, 0.0f);
  EXPECT_NEAR(table(3.0f, 4.0f).alpha, 0.5, 1e-6);
  EXPECT_NEAR(table(2.0f, 4.0f).alpha, 1.0 - std::sqrt(0.5), 1e-5);
}

TEST(SegmentTable, NotANumberHasItsOwnColor) {
  TransferFunction f = withOpacity(builtInOpacity("linear"));
  f.colors.nan = {1, 0, 1};
  const SegmentTable table(f, 0.01);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const PixelColor& c : {table(nan, 0.5f), table(0.5f, nan)})
    EXPECT_TRUE(c.r == 1.0f && c.g == 0.0f && c.b == 1.0f && c.alpha == 1.0f);
}

}  // namespace

}  // namespace esvr::test
