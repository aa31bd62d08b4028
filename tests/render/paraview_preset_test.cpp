// Plan: a preset as ParaView writes it is read point by point. Other files are refused with their
// name and the reason.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "esvr/transfer_function.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

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

}  // namespace
}  // namespace esvr::test
