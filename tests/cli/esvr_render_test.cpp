// Plan: a blob is drawn from an .esvr and from a .vdb file by a separate process, and the pictures
// are read back with libpng.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "cli/run_program.h"
#include "esvr/container.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/transfer_function.h"
#include "esvr/vdb_io.h"
#include "esvr/voxel_layer.h"
#include "field/random_field.h"
#include "support/on_device.h"

namespace esvr::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

struct Pixels {
  png_image header{};
  std::vector<png_byte> rgba;

  [[nodiscard]] const png_byte* at(int column, int row) const {
    return &rgba[4 * (std::size_t(row) * header.width + column)];
  }
  [[nodiscard]] std::vector<png_byte> corner() const { return {at(0, 0), at(0, 0) + 4}; }
};

Pixels readPng(const std::filesystem::path& path) {
  Pixels p;
  p.header.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_file(&p.header, path.c_str()), 0) << p.header.message;
  EXPECT_EQ(p.header.format, png_uint_32(PNG_FORMAT_RGBA)) << "8 bits, with alpha";
  p.header.format = PNG_FORMAT_RGBA;
  p.rgba.resize(PNG_IMAGE_SIZE(p.header));
  EXPECT_NE(png_image_finish_read(&p.header, nullptr, p.rgba.data(), 0, nullptr), 0);
  return p;
}

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

double psnrOf(const Pixels& a, const Pixels& b) {
  double squares = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    squares += std::pow((a.rgba[i] - b.rgba.at(i)) / 255.0, 2);
  return -10.0 * std::log10(squares / double(a.rgba.size()));
}

GridDescriptor density() {
  GridDescriptor d;
  d.name = "density";
  d.gridClass = GridClass::kFogVolume;
  d.transform = uniformTransform(0.5);
  return d;
}

class EsvrRender : public testing::Test {
 protected:
  EsvrRender() {
    Field field = randomField({.count = 12, .extent = 30.0, .smallest = 4.0, .aspect = 2.0});
    for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
    const SparseVolume volume = revoxelise(field, {});
    writeEsvr(folder_ / "in.esvr", {{}, {makeStoredGrid(density(), volume, field)}});
    const VolumeGrid grid{density(), volume, 0};
    writeGrids(folder_ / "in.vdb", {}, std::span(&grid, 1));
  }

  ProgramRun draw(const std::string& input, const std::string& output,
                  std::vector<std::string> more = {}) {
    more.insert(more.begin(), {folder_ / input, folder_ / output});
    if (std::find(more.begin(), more.end(), "--resolution") == more.end())
      more.insert(more.end(), {"--resolution", "64x48"});
    return runProgram(ESVR_RENDER, more);
  }
  Pixels picture(const std::string& input, const std::vector<std::string>& more = {}) {
    auto arguments = more;
    arguments.emplace_back("-f");
    const auto run = draw(input, "out.png", arguments);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return readPng(folder_ / "out.png");
  }
  void expectRefused(const std::vector<std::string>& more, int exitCode, const std::string& why) {
    const auto run = draw("in.esvr", "refused.png", more);
    EXPECT_EQ(run.exitCode, exitCode) << run.err;
    EXPECT_THAT(run.err, HasSubstr(why));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "refused.png"));
  }

  TemporaryFolder folder_;
};

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

TEST_F(EsvrRender, EllipsoidsLookLikeTheirVoxels) {
  // Bytes may differ by one. The background is black, because the color of an almost transparent
  // pixel is not well defined.
  const std::vector<std::string> black{"--background", "0,0,0"};
  EXPECT_GE(psnrOf(picture("in.esvr", black), picture("in.vdb", black)), 60.0);
}

TEST_F(EsvrRender, TheSumIsShownBetweenVoxelsWhereAskedFor) {
  // Between the voxels of blobs with scales of 4 voxels, trilinear interpolation differs from the
  // sum by a few percent.
  const std::vector<std::string> black{"--background", "0,0,0"};
  const Pixels sum = picture("in.esvr", {"--background", "0,0,0", "--between", "sum"});
  EXPECT_GE(psnrOf(sum, picture("in.vdb", black)), 35.0);
  EXPECT_NE(sum.rgba, picture("in.esvr", black).rgba);
  expectRefused({"--between", "nothing"}, 2, "--between");
}

TEST_F(EsvrRender, TheSumIsShownOfAFileThatWasFittedForDrawing) {
  EsvrFile file = readEsvr(folder_ / "in.esvr");
  file.grids[0].field.fitFor = FitFor::kDrawing;
  writeEsvr(folder_ / "drawing.esvr", file);
  EXPECT_EQ(picture("drawing.esvr").rgba, picture("in.esvr", {"--between", "sum"}).rgba);
  EXPECT_EQ(picture("drawing.esvr", {"--between", "voxels"}).rgba, picture("in.esvr").rgba);
}

TEST_F(EsvrRender, AFileThatHoldsItsVoxelsIsDrawnFromThem) {
  const VolumeGrid grid = readGrid(folder_ / "in.vdb", "density");
  const VoxelLayer layer = exactLayer(grid.volume);
  writeEsvr(folder_ / "voxels.esvr", {{}, {makeStoredVoxels(grid.descriptor, grid.volume, layer)}});
  EXPECT_EQ(picture("voxels.esvr").rgba, picture("in.vdb").rgba);
}

TEST_F(EsvrRender, IsTransparentAroundTheVolumeUnlessABackgroundIsGiven) {
  EXPECT_THAT(picture("in.esvr").corner(), ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(picture("in.esvr", {"--background", "1,0.5,0"}).corner(),
              ElementsAre(255, 128, 0, 255));
}

TEST_F(EsvrRender, TheMiddleOfTheVolumeIsInTheMiddleOfThePicture) {
  for (const char* input : {"in.esvr", "in.vdb"}) {
    EXPECT_GT(picture(input).at(32, 24)[3], 200) << input;
    EXPECT_GT(picture(input, {"--orthographic"}).at(32, 24)[3], 200) << input;
  }
}

TEST_F(EsvrRender, APresetAndARangeChangeThePicture) {
  writeText(folder_ / "tf.json", R"([{"Name": "red", "RGBPoints": [0, 1, 0, 0, 1, 1, 0, 0]}])");
  const auto red = picture("in.esvr", {"--tf", folder_ / "tf.json", "--preset", "red"});
  EXPECT_EQ(red.at(32, 24)[0], 255);
  EXPECT_EQ(red.at(32, 24)[1], 0);
  const auto own = picture("in.esvr", {"--tf", folder_ / "tf.json", "--range", "own"});
  EXPECT_NE(own.rgba, red.rgba);
  const auto given = picture("in.esvr", {"--tf", folder_ / "tf.json", "--range", "0,1"});
  EXPECT_EQ(given.rgba, own.rgba);
}

TEST_F(EsvrRender, ATurntableWritesAPictureForEveryAngle) {
  ASSERT_EQ(draw("in.esvr", "turn.png", {"--turntable", "3"}).exitCode, 0);
  EXPECT_THAT(folder_.names(),
              ElementsAre("in.esvr", "in.vdb", "turn.0000.png", "turn.0001.png", "turn.0002.png"));
  const auto first = readPng(folder_ / "turn.0000.png");
  EXPECT_EQ(first.rgba, picture("in.esvr").rgba);
  EXPECT_NE(first.rgba, readPng(folder_ / "turn.0001.png").rgba);
}

TEST_F(EsvrRender, AGivenCameraIsTaken) {
  const auto away = picture("in.esvr", {"--eye", "15,15,200", "--center", "15,15,400"});
  for (const png_byte v : away.rgba) ASSERT_EQ(v, 0);
  const auto seen =
      picture("in.esvr", {"--eye", "-90,15,15", "--center", "15,15,15", "--up", "0,0,1"});
  EXPECT_GT(seen.at(32, 24)[3], 0);
}

TEST_F(EsvrRender, ACameraFileIsReplacedByOptions) {
  writeText(folder_ / "cam.json", R"({"eye": [-90, 15, 15], "center": [15, 15, 15],
                                      "up": [0, 0, 1], "fov": 25})");
  const auto file = picture("in.esvr", {"--camera", folder_ / "cam.json"});
  const std::vector<std::string> same{"--eye", "-90,15,15", "--center", "15,15,15",
                                      "--up",  "0,0,1",     "--fov",    "25"};
  EXPECT_EQ(file.rgba, picture("in.esvr", same).rgba);
  EXPECT_NE(picture("in.esvr", {"--camera", folder_ / "cam.json", "--fov", "50"}).rgba, file.rgba);
  writeText(folder_ / "flat.json", R"({"height": 60})");
  EXPECT_EQ(picture("in.esvr", {"--camera", folder_ / "flat.json"}).rgba,
            picture("in.esvr", {"--orthographic", "--height", "60"}).rgba);
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

TEST_F(EsvrRender, ModesAndBoxesChangeThePicture) {
  const auto whole = picture("in.esvr");
  EXPECT_NE(picture("in.esvr", {"--mode", "maximum"}).rgba, whole.rgba);
  EXPECT_NE(picture("in.esvr", {"--mode", "average"}).rgba, whole.rgba);
  EXPECT_NE(picture("in.esvr", {"--clip", "0,0,0,15,40,40"}).rgba, whole.rgba);
  EXPECT_EQ(picture("in.esvr", {"--slice", "y=15"}).rgba,
            picture("in.esvr", {"--clip", "-99,14.5,-99,99,15.5,99"}).rgba);
  for (const png_byte v : picture("in.esvr", {"--clip", "500,0,0,501,1,1"}).rgba) ASSERT_EQ(v, 0);
}

TEST_F(EsvrRender, TheSamplingOfRaysChangesThePicture) {
  const auto usual = picture("in.esvr");
  EXPECT_NE(picture("in.esvr", {"--step", "4"}).rgba, usual.rgba);
  EXPECT_NE(picture("in.esvr", {"--opacity-length", "6"}).rgba, usual.rgba);
  EXPECT_NE(picture("in.esvr", {"--min-transmittance", "0.6"}).rgba, usual.rgba);
  // The error of a ray that ends at 1/4096 of the light is below one level of 8 bits.
  EXPECT_GE(psnrOf(picture("in.esvr", {"--min-transmittance", "0"}), usual), 48.0);
}

TEST_F(EsvrRender, TheGridThatIsNamedIsDrawn) {
  const auto stored = readEsvr(folder_ / "in.esvr").grids[0];
  auto other = stored;
  other.descriptor.name = "heat";
  for (float& i : other.field.chunks[0].ellipsoids.intensity) i *= -1.0f;
  writeEsvr(folder_ / "two.esvr", {{}, {stored, other}});
  const auto first = picture("in.esvr");
  EXPECT_EQ(picture("two.esvr").rgba, first.rgba);
  EXPECT_EQ(picture("two.esvr", {"--grid", "density"}).rgba, first.rgba);
  EXPECT_NE(picture("two.esvr", {"--grid", "heat"}).rgba, first.rgba);
}

TEST_F(EsvrRender, ValuesOfFewerBitsChangeThePictureALittle) {
  const auto floats = picture("in.vdb", {"--values", "float"});
  const auto fp4 = picture("in.vdb", {"--values", "fp4"});
  EXPECT_NE(fp4.rgba, floats.rgba);
  EXPECT_GT(psnrOf(fp4, floats), 20.0);
}

TEST_F(EsvrRender, PartsOfTheDepthAndMemoryChangeNothingOnGpu) {
  Device gpu;
  selectOrSkip("cuda", gpu);
  if (IsSkipped()) return;
  const auto usual = picture("in.esvr", {"--device", "cuda"});
  EXPECT_GE(psnrOf(picture("in.esvr", {"--device", "cuda", "--bins", "3"}), usual), 48.0);
  EXPECT_GE(psnrOf(picture("in.esvr", {"--device", "cuda", "--max-vram", "1"}), usual), 48.0);
  // A row of tiles of the widest picture takes more than 1 MB.
  const auto refused = draw("in.esvr", "none.png",
                            {"--device", "cuda", "--max-vram", "0.001", "--resolution", "32767x8"});
  EXPECT_EQ(refused.exitCode, 5) << refused.err;
}

TEST_F(EsvrRender, SomeFramesOfATurntableAreThoseOfTheWhole) {
  ASSERT_EQ(draw("in.esvr", "all.png", {"--turntable", "3"}).exitCode, 0);
  ASSERT_EQ(draw("in.esvr", "part.png", {"--turntable", "3", "--frames", "1-1"}).exitCode, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "part.0000.png"));
  EXPECT_EQ(readPng(folder_ / "part.0001.png").rgba, readPng(folder_ / "all.0001.png").rgba);
}

TEST_F(EsvrRender, ASavedTransferFunctionDrawsTheSame) {
  const auto first = picture(
      "in.esvr", {"--colors", "turbo", "--opacity", "tent", "--tf-save", folder_ / "tf.json"});
  const auto again = picture("in.esvr", {"--tf", folder_ / "tf.json", "--range", "own"});
  EXPECT_EQ(again.rgba, first.rgba);
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

TEST_F(EsvrRender, BricksAreTheVoxelsOfTheSum) {
  const auto bricks = picture("in.esvr", {"--method", "bricks", "--device", "cpu"});
  EXPECT_GE(psnrOf(bricks, picture("in.vdb", {"--device", "cpu"})), 60.0);
  EXPECT_EQ(draw("in.esvr", "auto.png", {"--method", "auto"}).exitCode, 0);
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
  EXPECT_GT(report["reference"]["frame_ms"], 0.0);
  EXPECT_GT(report["image"]["psnr"]["min"], 30.0);
}

TEST_F(EsvrRender, TheNumberOfThreadsChangesNothing) {
  EXPECT_EQ(picture("in.esvr", {"--threads", "1"}).rgba, picture("in.esvr").rgba);
}

TEST_F(EsvrRender, KeepsAPictureThatIsThere) {
  ASSERT_EQ(draw("in.esvr", "out.png").exitCode, 0);
  const auto before = readText(folder_ / "out.png");
  const auto again = draw("in.esvr", "out.png", {"--colors", "magma"});
  EXPECT_EQ(again.exitCode, 1);
  EXPECT_THAT(again.err, HasSubstr("--force"));
  EXPECT_EQ(readText(folder_ / "out.png"), before);
}

TEST_F(EsvrRender, OptionsThatMakeNoSenseAreRefused) {
  expectRefused({"--resolution", "64"}, 2, "--resolution");
  expectRefused({"--resolution", "0x4"}, 2, "--resolution");
  expectRefused({"--resolution", "40000x4"}, 2, "32767");
  expectRefused({"--step", "0"}, 2, "--step");
  expectRefused({"--step", "-1"}, 2, "--step");
  expectRefused({"--step", "nan"}, 2, "--step");
  expectRefused({"--opacity-length", "0"}, 2, "--opacity-length");
  expectRefused({"--colors", "jet"}, 2, "viridis");
  expectRefused({"--opacity", "cubic"}, 2, "tent");
  expectRefused({"--range", "3,1"}, 2, "LO <= HI");
  expectRefused({"--range", "1"}, 2, "--range");
  expectRefused({"--eye", "1,2"}, 2, "--eye");
  expectRefused({"--eye", "1,2,nan"}, 2, "--eye");
  expectRefused({"--eye", "0,9,0", "--center", "0,0,0", "--up", "0,1,0"}, 2, "up");
  expectRefused({"--fov", "180"}, 2, "field of view");
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
  expectRefused({"--bins", "17"}, 2, "--bins");
  expectRefused({"--values", "fp32"}, 2, "fp16");
  expectRefused({"--sheet", "s.png"}, 2, "--ref");
  expectRefused({"--min-transmittance", "1"}, 2, "transmittance");
  expectRefused({"--method", "tubes"}, 2, "bricks");
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
  EXPECT_EQ(draw("missing.esvr", "refused.png").exitCode, 3);
  EXPECT_EQ(draw("missing.vdb", "refused.png").exitCode, 3);
  writeText(folder_ / "bad.esvr", "nothing of the kind");
  EXPECT_EQ(draw("bad.esvr", "refused.png").exitCode, 3);
  EXPECT_EQ(draw("in.esvr", "refused.jpg").exitCode, 2);
}

TEST_F(EsvrRender, PicturesBeyondTheMemoryAllowedAreRefused) {
  const auto large =
      draw("in.esvr", "large.png", {"--resolution", "30000x30000", "--max-memory", "1GB"});
  EXPECT_EQ(large.exitCode, 5);
  EXPECT_THAT(large.err, AllOf(HasSubstr("30000 x 30000"), HasSubstr("43.2 GB")));
  EXPECT_EQ(draw("in.esvr", "large.png", {"--resolution", "100000x100000"}).exitCode, 2);
}

// ---- golden pictures

/// The options with which the blob is drawn.
struct Golden {
  const char *name, *input;
  std::vector<std::string> options;
};
std::ostream& operator<<(std::ostream& out, const Golden& golden) { return out << golden.name; }

class GoldenPicture : public EsvrRender, public testing::WithParamInterface<Golden> {
 protected:
  [[nodiscard]] static std::filesystem::path golden() {
    return std::string(ESVR_SOURCE_DIR "/tests/cli/golden/") + GetParam().name + ".png";
  }
};

// Instruction sets differ by about 1e-6 of a value, which can change a channel by one level of 8
// bits. A ray may also end one sample later, which changes a channel by at most 1/4096.
// ESVR_UPDATE_GOLDEN=1 stores the pictures of this machine after an intended change.
TEST_P(GoldenPicture, isDrawnAgain) {
  auto options = GetParam().options;
  options.insert(options.end(), {"--device", "cpu", "--resolution", "48x48"});
  const Pixels found = picture(GetParam().input, options);
  if (std::getenv("ESVR_UPDATE_GOLDEN"))
    std::filesystem::copy_file(folder_ / "out.png", golden(),
                               std::filesystem::copy_options::overwrite_existing);
  const Pixels expected = readPng(golden());
  ASSERT_EQ(found.rgba.size(), expected.rgba.size());
  int largest = 0, visible = 0;
  for (std::size_t i = 0; i < expected.rgba.size(); ++i) {
    largest = std::max(largest, std::abs(int(found.rgba[i]) - int(expected.rgba[i])));
    visible += expected.rgba[i] > 0;
  }
  EXPECT_LE(largest, 2);
  EXPECT_GT(visible, 1000) << "an empty picture proves nothing";
}

INSTANTIATE_TEST_SUITE_P(
    Pictures, GoldenPicture,
    testing::Values(Golden{"ellipsoids", "in.esvr", {}}, Golden{"voxels", "in.vdb", {}},
                    Golden{"sum", "in.esvr", {"--between", "sum", "--colors", "inferno"}},
                    Golden{"bricks", "in.esvr", {"--method", "bricks", "--opacity", "tent"}},
                    Golden{"maximum", "in.esvr", {"--mode", "maximum", "--background", "1,1,1"}},
                    Golden{"slice", "in.vdb", {"--slice", "z=15", "--opacity-length", "0.2"}},
                    Golden{"orthographic", "in.esvr", {"--orthographic", "--eye", "15,15,90"}}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST_F(EsvrRender, HelpNamesEveryBuiltInFunction) {
  const auto help = runProgram(ESVR_RENDER, {"--help"});
  EXPECT_EQ(help.exitCode, 0);
  for (const auto& name : builtInColorMaps()) EXPECT_THAT(help.out, HasSubstr(name));
  for (const auto& name : builtInOpacities()) EXPECT_THAT(help.out, HasSubstr(name));
}

}  // namespace
}  // namespace esvr::test
