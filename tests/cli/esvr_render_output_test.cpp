// Plan: the files that a separate process writes are read back with libpng, OpenEXR and a JSON
// reader: pictures, distances, comparisons with a reference and measured speeds.

#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/esvr_render_fixture.h"
#include "cli/exr_channel.h"
#include "esvr/transfer_function.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(EsvrRender, WritesAPictureOfTheSizeAskedForAndSaysSo) {
  const auto run = draw("in.esvr", "out.png");
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.out, "");
  EXPECT_THAT(run.err, HasSubstr("density, 64 x 48"));
  const auto pixels = readPng(folder_ / "out.png");
  EXPECT_EQ(pixels.header.width, 64u);
  EXPECT_EQ(pixels.header.height, 48u);
  EXPECT_THAT(folder_.names(), ElementsAre("in.esvr", "in.vdb", "out.png"));
}

TEST_F(EsvrRender, ThePictureHoldsItsCommandLine) {
  ASSERT_EQ(draw("in.esvr", "out.png", {"--colors", "magma"}).exitCode, 0);
  const std::string bytes = readText(folder_ / "out.png");
  EXPECT_THAT(bytes, HasSubstr("out.png --colors magma --resolution 64x48"));
  EXPECT_THAT(bytes, HasSubstr("esvr-render 0."));
}

TEST_F(EsvrRender, APngMayHave16BitsAChannel) {
  ASSERT_EQ(draw("in.esvr", "out.png", {"--bits", "16"}).exitCode, 0);
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&header, (folder_ / "out.png").c_str()), 0);
  EXPECT_NE(header.format & PNG_FORMAT_FLAG_LINEAR, 0u) << "how libpng says 16 bits";
  png_image_free(&header);
}

TEST_F(EsvrRender, AnExrHasTheSamePictureInLinearLight) {
  ASSERT_EQ(draw("in.esvr", "out.exr", {"--colors", "grayscale"}).exitCode, 0);
  const auto red = readExr(folder_ / "out.exr", "R"), alpha = readExr(folder_ / "out.exr", "A");
  const auto png = picture("in.esvr", {"--colors", "grayscale"});
  ASSERT_EQ(red.size(), 64u * 48u);
  const std::size_t middle = 24 * 64 + 32;
  EXPECT_NEAR(alpha[middle], png.at(32, 24)[3] / 255.0, 0.5 / 255 + 1e-6);
  const double color = png.at(32, 24)[0] / 255.0;
  // Half a level of 255 corresponds to at most 2.4 half levels in linear light.
  EXPECT_NEAR(red[middle], alpha[middle] * std::pow((color + 0.055) / 1.055, 2.4), 2.4 / 255);
  EXPECT_EQ(alpha[0], 0.0f);
  Imf::InputFile file((folder_ / "out.exr").c_str());
  EXPECT_THAT(Imf::comments(file.header()), HasSubstr("out.exr --colors grayscale"));
}

TEST_F(EsvrRender, DistancesAreWrittenWhereLightStops) {
  const std::vector<std::string> more{"--depth", folder_ / "z.exr", "--opacity-length", "0.5"};
  ASSERT_EQ(draw("in.esvr", "out.png", more).exitCode, 0);
  const auto depth = readExr(folder_ / "z.exr", "Z");
  EXPECT_TRUE(std::isinf(depth[0])) << "a corner that shows nothing";
  EXPECT_GT(depth[24 * 64 + 32], 10.0f);
  EXPECT_LT(depth[24 * 64 + 32], 300.0f);
}

TEST_F(EsvrRender, KeepsAPictureThatIsThere) {
  ASSERT_EQ(draw("in.esvr", "out.png").exitCode, 0);
  const auto before = readText(folder_ / "out.png");
  const auto again = draw("in.esvr", "out.png", {"--colors", "magma"});
  EXPECT_EQ(again.exitCode, 1);
  EXPECT_THAT(again.err, HasSubstr("--force"));
  EXPECT_EQ(readText(folder_ / "out.png"), before);
}

TEST_F(EsvrRender, ComparesWithAReference) {
  const auto run = draw("in.esvr", "out.png",
                        {"--ref", folder_ / "in.vdb", "--report", folder_ / "report.json",
                         "--sheet", folder_ / "sheet.png"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out.error.png"));
  EXPECT_EQ(readPng(folder_ / "sheet.png").header.width, 3u * 64u);
  const auto report = nlohmann::json::parse(readText(folder_ / "report.json"));
  EXPECT_GT(report["comparisons"][0]["psnr"], 30.0);
  EXPECT_GT(report["comparisons"][0]["ssim"], 0.9);
}

TEST_F(EsvrRender, ComparesWithAReferenceOfManyRays) {
  const auto psnr = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all{"--ref", folder_ / "in.vdb", "--report", folder_ / "report.json",
                                 "-f"};
    all.insert(all.end(), more.begin(), more.end());
    EXPECT_EQ(draw("in.vdb", "out.png", all).exitCode, 0);
    const auto report = nlohmann::json::parse(readText(folder_ / "report.json"));
    return report["comparisons"][0]["psnr"];
  };
  EXPECT_TRUE(psnr({}).is_null()) << "the same picture: an infinite PSNR";
  EXPECT_GT(psnr({"--ref-supersample", "3"}), 30.0);
  expectRefused({"--ref-supersample", "3"}, 2, "--ref-supersample needs --ref");
  expectRefused({"--ref", folder_ / "in.vdb", "--ref-supersample", "0"}, 2, "--ref-supersample");
  expectRefused({"--ref", folder_ / "in.vdb", "--ref-supersample", "16", "--resolution", "4000x8"},
                2, "--ref-supersample");
}

TEST_F(EsvrRender, MeasuresWithoutKeepingAPicture) {
  const auto run =
      runProgram(ESVR_RENDER, {folder_ / "in.esvr", "--bench", "--turntable", "3", "--resolution",
                               "64x48", "--ref", folder_ / "in.vdb", "--report", "-", "-q"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto report = nlohmann::json::parse(run.out);
  EXPECT_EQ(report["views"], 3);
  EXPECT_GT(report["drawn"]["fps_median"], 0.0);
  EXPECT_GE(report["drawn"]["fps_median"], report["drawn"]["fps_1_percent_low"]);
  EXPECT_GT(report["drawn"]["cold_fps_median"], 0.0);
  EXPECT_GT(report["screen_occupancy"], 0.1);
  EXPECT_LT(report["screen_occupancy"], 0.9) << "the corners of the picture are empty";
  EXPECT_GT(report["reference"]["frame_ms"], 0.0);
  EXPECT_GT(report["image"]["psnr"]["min"], 30.0);
}

TEST_F(EsvrRender, HelpNamesEveryBuiltInFunction) {
  const auto help = runProgram(ESVR_RENDER, {"--help"});
  EXPECT_EQ(help.exitCode, 0);
  for (const auto& name : builtInColorMaps()) EXPECT_THAT(help.out, HasSubstr(name));
  for (const auto& name : builtInOpacities()) EXPECT_THAT(help.out, HasSubstr(name));
}

}  // namespace
}  // namespace esvr::test
