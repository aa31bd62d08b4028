// Plan: curves follow their definition at ends, midpoints and beyond. Built-in maps agree with
// entries of the published tables of 256 colors that are not in the library's tables. Linear
// interpolation between every fifth entry is within 2/255 of all 256 entries, and rounding adds
// half a level.
#include "esvr/transfer_function.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "render/expect_color.h"

namespace esvr::test {
namespace {

constexpr double kExact = 1e-12, kTable = 2.5 / 255.0;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

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
    EXPECT_NEAR(opacityAt(builtInOpacity("linear"), at[i]), linear[i], kExact);
    EXPECT_NEAR(opacityAt(builtInOpacity("inverse"), at[i]), 1.0 - linear[i], kExact);
    EXPECT_NEAR(opacityAt(builtInOpacity("tent"), at[i]), tent[i], kExact);
    EXPECT_NEAR(opacityAt(builtInOpacity("step"), at[i]), step[i], kExact);
  }
}

TEST(OpacityCurve, TheMidpointHasHalfOfTheChange) {
  for (const double sharpness : {0.0, 0.3, 0.7}) {
    const OpacityCurve curve{{0.0, 0.2, 0.8, sharpness}, {1.0, 0.6}};
    EXPECT_NEAR(opacityAt(curve, 0.8), 0.4, kExact);
    EXPECT_NEAR(opacityAt(curve, 0.0), 0.2, kExact);
    EXPECT_NEAR(opacityAt(curve, 1.0), 0.6, kExact);
  }
}

TEST(OpacityCurve, SharpnessDrawsTheCurveToItsEnds) {
  // By the formula, s = 0.25 becomes 0.5 * 0.5^6 = 1/128 for sharpness 0.5. The Hermite curve with
  // tangents 0.5 is then 3 s^2 - 2 s^3 + 0.5 (2 s^3 - 3 s^2 + s).
  const OpacityCurve curve{{0.0, 0.0, 0.5, 0.5}, {1.0, 1.0}};
  const double s = 1.0 / 128, s2 = s * s, s3 = s2 * s;
  EXPECT_NEAR(opacityAt(curve, 0.25), 3 * s2 - 2 * s3 + 0.5 * (2 * s3 - 3 * s2 + s), kExact);
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
  expectColor(colorAt(f.colors, 0.0), {0.25, 0.25, 0.25}, kExact);
  EXPECT_NEAR(opacityAt(f.opacity, 2.0), 1.0, kExact);
  EXPECT_NEAR(opacityAt(f.opacity, 6.0), 0.0, kExact);
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

}  // namespace
}  // namespace esvr::test
