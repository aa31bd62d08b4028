// Plan: the files that a separate process writes are read back with libpng, OpenEXR and a JSON reader.
// A script stands for ffmpeg and keeps the pixels or the arguments that it gets.

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <sys/stat.h>

#include "cli/esvr_render_fixture.h"
#include "esvr/transfer_function.h"
#include "support/files.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// One channel of an EXR, row after row.
std::vector<float> readExr(const std::filesystem::path& path, const char* channel) {
  Imf::InputFile file(path.c_str());
  const Imath::Box2i window = file.header().dataWindow();
  const std::size_t width = std::size_t(window.max.x) + 1, height = std::size_t(window.max.y) + 1;
  EXPECT_NE(file.header().channels().findChannel(channel), nullptr);
  std::vector<float> values(width * height);
  Imf::FrameBuffer buffer;
  buffer.insert(channel, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()),
                                    sizeof(float), sizeof(float) * width));
  file.setFrameBuffer(buffer);
  file.readPixels(0, window.max.y);
  return values;
}

TEST_F(EsvrRender, WritesAPictureOfTheSizeAskedForAndSaysSo) {
  const auto run = succeeded(draw("in.esvr", "out.png"));
  EXPECT_EQ(run.out, "");
  EXPECT_THAT(run.err, HasSubstr("density, 64 x 48"));
  const auto pixels = readPng(folder_ / "out.png");
  EXPECT_EQ(pixels.header.width, 64u);
  EXPECT_EQ(pixels.header.height, 48u);
  EXPECT_THAT(folder_.names(), ElementsAre("in.esvr", "in.vdb", "out.png"));
}

TEST_F(EsvrRender, ThePictureHoldsItsCommandLine) {
  succeeded(draw("in.esvr", "out.png", {"--colors", "magma"}));
  const std::string bytes = readText(folder_ / "out.png");
  EXPECT_THAT(bytes, HasSubstr("out.png --colors magma --resolution 64x48"));
  EXPECT_THAT(bytes, HasSubstr("esvr-render 0."));
}

TEST_F(EsvrRender, APngMayHave16BitsAChannel) {
  succeeded(draw("in.esvr", "out.png", {"--bits", "16"}));
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&header, (folder_ / "out.png").c_str()), 0);
  EXPECT_NE(header.format & PNG_FORMAT_FLAG_LINEAR, 0u) << "how libpng says 16 bits";
  png_image_free(&header);
}

TEST_F(EsvrRender, AnExrHasTheSamePictureInLinearLight) {
  succeeded(draw("in.esvr", "out.exr", {"--colors", "grayscale"}));
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
  const Words more{"--depth", folder_ / "z.exr", "--opacity-length", "0.5"};
  succeeded(draw("in.esvr", "out.png", more));
  const auto depth = readExr(folder_ / "z.exr", "Z");
  EXPECT_TRUE(std::isinf(depth[0])) << "a corner that shows nothing";
  EXPECT_GT(depth[24 * 64 + 32], 10.0f);
  EXPECT_LT(depth[24 * 64 + 32], 300.0f);
}

TEST_F(EsvrRender, KeepsAPictureThatIsThere) {
  succeeded(draw("in.esvr", "out.png"));
  const auto before = readText(folder_ / "out.png");
  EXPECT_THAT(draw("in.esvr", "out.png", {"--colors", "magma"}), Fails(1, "--force"));
  EXPECT_EQ(readText(folder_ / "out.png"), before);
}

TEST_F(EsvrRender, ComparesWithAReference) {
  succeeded(draw("in.esvr", "out.png",
                 {"--ref", folder_ / "in.vdb", "--report", folder_ / "report.json", "--sheet",
                  folder_ / "sheet.png"}));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out.error.png"));
  EXPECT_EQ(readPng(folder_ / "sheet.png").header.width, 3u * 64u);
  const auto report = Json::parse(readText(folder_ / "report.json"));
  EXPECT_GT(report["comparisons"][0]["psnr"], 30.0);
  EXPECT_GT(report["comparisons"][0]["ssim"], 0.9);
}

TEST_F(EsvrRender, ComparesWithAReferenceOfManyRays) {
  const auto psnr = [&](const Words& more) {
    succeeded(draw(
        "in.vdb", "out.png",
        joined({"--ref", folder_ / "in.vdb", "--report", folder_ / "report.json", "-f"}, more)));
    const auto report = Json::parse(readText(folder_ / "report.json"));
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
  const auto run = succeeded(
      runProgram(ESVR_RENDER, {folder_ / "in.esvr", "--bench", "--turntable", "3", "--resolution",
                               "64x48", "--ref", folder_ / "in.vdb", "--report", "-", "-q"}));
  const auto report = Json::parse(run.out);
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
  const auto help = succeeded(runProgram(ESVR_RENDER, {"--help"}));
  for (const auto& name : builtInColorMaps()) EXPECT_THAT(help.out, HasSubstr(name));
  for (const auto& name : builtInOpacities()) EXPECT_THAT(help.out, HasSubstr(name));
}

class EsvrRenderLegend : public EsvrRender {
 protected:
  /// A camera that is given, so that the bar does not move it.
  static Words withLegend(bool legend) {
    Words options{"--orthographic", "--height", "60", "--resolution", "120x200", "--step", "4"};
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
  const Words opaque{"--legend", "--resolution", "200x200", "--opacity-length", "0.01"};
  EXPECT_TRUE(hasGap(picture("in.esvr", opaque)));
  auto large = opaque;
  EXPECT_FALSE(hasGap(picture("in.esvr", joined(large, {"--orthographic", "--height", "15"}))))
      << "the volume lies behind the bar";
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
    succeeded(
        draw("in.esvr", "out.png",
             joined(more, {"--ref", folder_ / "in.vdb", "--report", folder_ / "r.json", "-f"})));
    const auto report = Json::parse(readText(folder_ / "r.json"));
    return report["comparisons"][0]["psnr"].get<double>();
  };
  EXPECT_EQ(psnr(true), psnr(false));
}

TEST_F(EsvrRenderLegend, IsRefusedWhereItCannotBeDrawn) {
  EXPECT_THAT(draw("in.esvr", "out.exr", {"--legend"}), Fails(2, "--legend"));
  EXPECT_THAT(runProgram(ESVR_RENDER, {folder_ / "in.esvr", "--bench", "--legend"}), Fails(2));
}

class EsvrRenderTurn : public EsvrRender {
 protected:
  void useFfmpeg(const std::string& script) { path_.add("ffmpeg", kOutputOfFfmpeg + script); }

  SearchPath path_;
};

TEST_F(EsvrRenderTurn, AVideoHasThePicturesOfTheFiles) {
  useFfmpeg("cat > \"$out\"");
  const Words turn{"--turntable", "3", "--background", "0,0,0"};
  EXPECT_THAT(succeeded(draw("in.esvr", "turn.mp4", turn)).err,
              HasSubstr("3 pictures, 0.1 s of video"));
  std::string expected;
  succeeded(draw("in.esvr", "turn.png", turn));
  for (const char* file : {"turn.0000.png", "turn.0001.png", "turn.0002.png"}) {
    const Pixels picture = readPng(folder_ / file);
    for (std::size_t i = 0; i < picture.rgba.size(); ++i)
      if (i % 4 != 3) expected.push_back(char(picture.rgba[i]));
  }
  EXPECT_TRUE(readText(folder_ / "turn.mp4") == expected);
}

TEST_F(EsvrRenderTurn, FfmpegGetsTheRateAndTheCommandLine) {
  useFfmpeg("cat > /dev/null; echo \"$@\" > \"$out\"");
  succeeded(draw("in.esvr", "turn.webm", {"--turntable", "2", "--fps", "12.5"}));
  const std::string arguments = readText(folder_ / "turn.webm");
  EXPECT_THAT(arguments, HasSubstr("-framerate 12.5 "));
  EXPECT_THAT(arguments, HasSubstr("64x48"));
  EXPECT_THAT(arguments, HasSubstr("turn.webm --turntable 2 --fps 12.5"));
}

TEST_F(EsvrRenderTurn, AnInterruptedVideoLeavesNothing) {
  useFfmpeg("exec sleep 60");
  EXPECT_THAT(runInterrupted(ESVR_RENDER, {folder_ / "in.esvr", folder_ / "turn.mp4", "--turntable",
                                           "9999", "--resolution", "64x48"}),
              Fails(1, "interrupted; nothing was written"));
  EXPECT_THAT(folder_.names(), ElementsAre("in.esvr", "in.vdb"));
}

TEST_F(EsvrRenderTurn, AnInterruptionSaysHowManyPicturesItLeaves) {
  EXPECT_THAT(runInterrupted(ESVR_RENDER,
                             {folder_ / "in.esvr", folder_ / "turn.png", "--turntable", "9999",
                              "--resolution", "64x48"},
                             "turn.0001.png"),
              Fails(1, "interrupted; ", " of 9999 pictures "));
}

TEST_F(EsvrRenderTurn, WhatAVideoCannotBeIsRefused) {
  useFfmpeg("cat > \"$out\"");
  const auto refused = [&](Words more, const std::string& why) {
    EXPECT_THAT(draw("in.esvr", "turn.mp4", std::move(more)), Fails(2, why));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "turn.mp4"));
  };
  refused({}, "--turntable");
  refused({"--turntable", "2", "--resolution", "63x48"}, "even");
  refused({"--turntable", "2", "--bits", "16"}, "--bits");
  refused({"--turntable", "2", "--ref", folder_ / "in.vdb"}, "--ref");
  refused({"--turntable", "2", "--fps", "0"}, "--fps");
  expectRefused({"--turntable", "2", "--fps", "30"}, 2, "--fps");
}

TEST_F(EsvrRenderTurn, APatternOrAFolderNamesThePictures) {
  const Words turn{"--turntable", "2"};
  succeeded(draw("in.esvr", "a_%02d_b.png", turn));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a_00_b.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a_01_b.png"));
  succeeded(draw("in.esvr", "new/", turn));
  succeeded(draw("in.esvr", "new", {"--turntable", "3", "--frames", "2-2"}));
  for (const char* file : {"frame.0000.png", "frame.0001.png", "frame.0002.png"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / "new" / file)) << file;
  EXPECT_THAT(draw("in.esvr", "new"), Fails(2)) << "a single picture needs a name";
}

TEST_F(EsvrRenderTurn, DistancesAreFilesBesideAVideo) {
  useFfmpeg("cat > \"$out\"");
  succeeded(draw("in.esvr", "turn.mp4", {"--turntable", "2", "--depth", folder_ / "z_%d.exr"}));
  EXPECT_THAT(folder_.names(), ElementsAre("in.esvr", "in.vdb", "turn.mp4", "z_0.exr", "z_1.exr"));
}

TEST_F(EsvrRender, OptionsThatMakeNoSenseAreRefused) {
  expectRefused({"--resolution", "64"}, 2, "--resolution");
  expectRefused({"--resolution", "0x4"}, 2, "--resolution");
  expectRefused({"--resolution", "40000x4"}, 2, "32767");
  expectRefused({"--step", "0"}, 2, "--step");
  expectRefused({"--opacity-length", "0"}, 2, "--opacity-length");
  expectRefused({"--colors", "jet"}, 2, "viridis");
  expectRefused({"--opacity", "cubic"}, 2, "tent");
  expectRefused({"--range", "3,1"}, 2, "LO <= HI");
  expectRefused({"--range", "1"}, 2, "--range");
  expectRefused({"--eye", "1,2"}, 2, "--eye");
  expectRefused({"--fov", "20", "--orthographic"}, 2, "--fov");
  expectRefused({"--height", "20"}, 2, "--orthographic");
  expectRefused({"--background", "1,2,3"}, 2, "--background");
  expectRefused({"--turntable", "0"}, 2, "--turntable");
  expectRefused({"--preset", "x"}, 2, "--tf");
  expectRefused({"--bits", "12"}, 2, "--bits");
  expectRefused({"--mode", "minimum"}, 2, "maximum");
  expectRefused({"--clip", "1,0,0,0,1,1"}, 2, "clip");
  expectRefused({"--clip", "0,0,0,1,1,1", "--slice", "x=1"}, 2, "--slice");
  expectRefused({"--slice", "w=1"}, 2, "--slice");
  expectRefused({"--slice", "z="}, 2, "--slice");
  expectRefused({"--frames", "0-1"}, 2, "--turntable");
  expectRefused({"--turntable", "3", "--frames", "2-3"}, 2, "--frames");
  expectRefused({"--depth", "z.png"}, 2, ".exr");
  expectRefused({"--depth-parts", "17"}, 2, "--depth-parts");
  expectRefused({"--values", "fp32"}, 2, "fp16");
  expectRefused({"--sheet", "s.png"}, 2, "--ref");
  expectRefused({"--min-transmittance", "1"}, 2, "transmittance");
  expectRefused({"--device", "gpu"}, 2, "gpu");
  expectRefused({"--bench"}, 2, "--bench");
  expectRefused({"--report", "r.json"}, 2, "--ref");
}

TEST_F(EsvrRender, InputThatCannotBeDrawnIsRefused) {
  expectRefused({"--grid", "none"}, 3, "density");
  expectRefused({"--tf", folder_ / "missing.json"}, 3, "missing.json");
  expectRefused({"--ref", folder_ / "missing.vdb"}, 3, "missing.vdb");
  expectRefused({"--camera", folder_ / "missing.json"}, 3, "missing.json");
  writeText(folder_ / "cam.json", R"({"eye": [1, 2]})");
  expectRefused({"--camera", folder_ / "cam.json"}, 3, "three numbers");
  writeText(folder_ / "cam.json", R"({"eyes": [1, 2, 3]})");
  expectRefused({"--camera", folder_ / "cam.json"}, 3, "eyes");
  EXPECT_THAT(draw("missing.esvr", "refused.png"), Fails(3));
  EXPECT_THAT(draw("missing.vdb", "refused.png"), Fails(3));
  writeText(folder_ / "bad.esvr", "nothing of the kind");
  EXPECT_THAT(draw("bad.esvr", "refused.png"), Fails(3));
  EXPECT_THAT(draw("in.esvr", "refused.jpg"), Fails(2));
}

TEST_F(EsvrRender, PicturesBeyondTheMemoryAllowedAreRefused) {
  const auto large =
      draw("in.esvr", "large.png", {"--resolution", "30000x30000", "--max-memory", "1GB"});
  EXPECT_THAT(large, Fails(5, "30000 x 30000", "43.2 GB"));
  EXPECT_THAT(draw("in.esvr", "large.png", {"--resolution", "100000x100000"}), Fails(2));
}

TEST_F(EsvrRender, TwoOutputsAreNeverOneFile) {
  const Words reference{"--ref", folder_ / "in.vdb"};
  const auto with = [&](const Words& more) { return joined(more, reference); };
  expectRefused(with({"--sheet", folder_ / "refused.png"}), 2, "are one file");
  expectRefused(with({"--sheet", folder_ / "refused.error.png"}), 2, "are one file");
  std::filesystem::create_symlink(folder_ / "in.vdb", folder_ / "link.png");
  expectRefused(with({"--sheet", folder_ / "link.png", "--force"}), 2, "are one file");
}

TEST_F(EsvrRender, APipeWithoutAWriterIsRefusedSlow) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  expectRefused({"--camera", folder_ / "pipe"}, 3, "no program writes to it");
  expectRefused({"--tf", folder_ / "pipe"}, 3, "no program writes to it");
}

TEST_F(EsvrRender, ACameraMayComeThroughAPipe) {
  succeeded(runProgram(
      "/bin/bash", {"-c", std::string(ESVR_RENDER) + " - " + (folder_ / "out.png").string() +
                              " --resolution 16x16 --camera <(echo '{\"eye\": [1, 2, 90]}') < " +
                              (folder_ / "in.esvr").string()}));
}

}  // namespace
}  // namespace esvr::test
