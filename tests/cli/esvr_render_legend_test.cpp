// Plan: a separate process draws a blob with and without a color bar. The tests compare the
// pictures, and look for the unit in the part of the picture that has the texts.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/esvr_render_fixture.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

class EsvrRenderLegend : public EsvrRender {
 protected:
  /// A camera that is given, so that the bar does not move it.
  static std::vector<std::string> withLegend(bool legend) {
    std::vector<std::string> options{"--orthographic", "--height", "60", "--resolution",
                                     "120x200",        "--step",   "4"};
    if (legend) options.emplace_back("--legend");
    return options;
  }
  /// Writes a file whose grid has one metadata item.
  void writeGrid(const std::string& name, const MetaItem& item) {
    VolumeGrid grid = readGrid(folder_ / "in.vdb", "density");
    grid.descriptor.metadata = {item};
    writeGrids(folder_ / name, {}, std::span(&grid, 1));
  }
};

TEST_F(EsvrRenderLegend, IsDrawnAtTheRightEdge) {
  const Pixels plain = picture("in.esvr", withLegend(false));
  const Pixels bar = picture("in.esvr", withLegend(true));
  EXPECT_NE(bar.rgba, plain.rgba);
  for (int row = 0; row < 200; ++row)
    for (int column = 0; column < 70; ++column)
      ASSERT_TRUE(
          std::equal(plain.at(column, row), plain.at(column, row) + 4, bar.at(column, row)));
}

/// True if a column of the right half shows nothing, between the volume and the bar.
bool hasGap(const Pixels& picture) {
  const int width = int(picture.header.width), height = int(picture.header.height);
  for (int column = width / 2; column < width; ++column) {
    bool empty = true;
    for (int row = 0; row < height; ++row) empty &= picture.at(column, row)[3] == 0;
    if (empty) return true;
  }
  return false;
}

TEST_F(EsvrRenderLegend, LeavesRoomForItself) {
  const std::vector<std::string> opaque{"--legend", "--resolution", "200x200", "--opacity-length",
                                        "0.01"};
  EXPECT_TRUE(hasGap(picture("in.esvr", opaque)));
  auto large = opaque;
  large.insert(large.end(), {"--orthographic", "--height", "15"});
  EXPECT_FALSE(hasGap(picture("in.esvr", large))) << "the volume lies behind the bar";
}

TEST_F(EsvrRenderLegend, ShowsTheUnitOfTheGrid) {
  writeGrid("unit.vdb", stringItem("unit", "kg"));
  writeGrid("units.vdb", stringItem("units", "kg"));
  writeGrid("other.vdb", stringItem("note", "kg"));
  const auto without = picture("in.vdb", withLegend(true)).rgba;
  const auto unit = picture("unit.vdb", withLegend(true)).rgba;
  EXPECT_NE(unit, without);
  EXPECT_EQ(picture("units.vdb", withLegend(true)).rgba, unit);
  EXPECT_EQ(picture("other.vdb", withLegend(true)).rgba, without);
  EXPECT_EQ(picture("unit.vdb", withLegend(false)).rgba, picture("in.vdb", withLegend(false)).rgba);
}

TEST_F(EsvrRenderLegend, DoesNotCountInComparisons) {
  const auto psnr = [&](bool legend) {
    auto more = withLegend(legend);
    more.insert(more.end(), {"--ref", folder_ / "in.vdb", "--report", folder_ / "r.json", "-f"});
    EXPECT_EQ(draw("in.esvr", "out.png", more).exitCode, 0);
    const auto report = nlohmann::json::parse(readText(folder_ / "r.json"));
    return report["comparisons"][0]["psnr"].get<double>();
  };
  EXPECT_EQ(psnr(true), psnr(false));
}

TEST_F(EsvrRenderLegend, FitsIntoTinyPictures) {
  for (const char* size : {"1x1", "16x16", "3x200", "200x3"})
    EXPECT_EQ(draw("in.esvr", "out.png", {"--legend", "-f", "--resolution", size}).exitCode, 0)
        << size;
}

TEST_F(EsvrRenderLegend, IsRefusedWhereItCannotBeDrawn) {
  const auto exr = draw("in.esvr", "out.exr", {"--legend"});
  EXPECT_EQ(exr.exitCode, 2);
  EXPECT_THAT(exr.err, HasSubstr("--legend"));
  EXPECT_EQ(runProgram(ESVR_RENDER, {folder_ / "in.esvr", "--bench", "--legend"}).exitCode, 2);
}

}  // namespace
}  // namespace esvr::test
