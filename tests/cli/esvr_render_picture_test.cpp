// Plan: a blob is drawn from an .esvr and from a .vdb file by a separate process. Pictures that
// must be equal or alike are compared with each other, and so are pictures that an option must
// change.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/esvr_render_fixture.h"
#include "esvr/voxel_layer.h"
#include "support/on_device.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;

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

TEST_F(EsvrRender, AFileThatHoldsItsVoxelsIsDrawnFromThem) {
  const VolumeGrid grid = readGrid(folder_ / "in.vdb", "density");
  const VoxelLayer layer = exactLayer(grid.volume);
  writeEsvr(folder_ / "voxels.esvr", {{}, {makeStoredVoxels(grid.descriptor, grid.volume, layer)}});
  EXPECT_EQ(picture("voxels.esvr").rgba, picture("in.vdb").rgba);
}

TEST_F(EsvrRender, EllipsoidsAreDrawnAsTheirVoxels) {
  EXPECT_GE(psnrOf(picture("in.esvr", {"--device", "cpu"}), picture("in.vdb", {"--device", "cpu"})),
            60.0);
}

// The mask leaves out half of the volume, which the ellipsoids alone would show.
TEST_F(EsvrRender, AStoredMaskIsDrawn) {
  EsvrFile file = readEsvr(folder_ / "in.esvr");
  StoredGrid& grid = file.grids[0];
  grid.topology = TopologyKind::kMask;
  grid.bricks = reachedBricks(grid.field);
  grid.mask.assign(grid.bricks.size(), BrickMask{});
  for (std::size_t b = 0; b < grid.bricks.size() / 2; ++b) grid.mask[b].setAll();
  writeEsvr(folder_ / "mask.esvr", file);
  EXPECT_NE(picture("mask.esvr").rgba, picture("in.esvr").rgba);
  EXPECT_LT(psnrOf(picture("mask.esvr"), picture("in.esvr")), 40.0);
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

TEST_F(EsvrRender, AComponentOfVectorsIsDrawnOnlyWhereThereIsNothingElse) {
  const auto stored = readEsvr(folder_ / "in.esvr").grids[0];
  auto component = stored;
  component.descriptor.name = "velocity";
  for (float& i : component.field.chunks[0].ellipsoids.intensity) i *= -1.0f;
  EsvrFile file{{}, {component, component, component, stored}, {}, {{"velocity", 0}}};
  writeEsvr(folder_ / "vectors.esvr", file);
  EXPECT_EQ(picture("vectors.esvr").rgba, picture("in.esvr").rgba);
  file.grids.pop_back();
  std::filesystem::remove(folder_ / "vectors.esvr");
  writeEsvr(folder_ / "vectors.esvr", file);
  EXPECT_NE(picture("vectors.esvr").rgba, picture("in.esvr").rgba);
}

TEST_F(EsvrRender, ValuesOfFewerBitsChangeThePictureALittle) {
  const auto floats = picture("in.vdb", {"--values", "float"});
  const auto fp4 = picture("in.vdb", {"--values", "fp4"});
  EXPECT_NE(fp4.rgba, floats.rgba);
  EXPECT_GT(psnrOf(fp4, floats), 20.0);
}

TEST_F(EsvrRender, ALevelSetIsAnOpaqueBodyUnlessAnOptionSaysOtherwise) {
  VolumeGrid grid = readGrid(folder_ / "in.vdb", "density");
  grid.descriptor = density();  // without the metadata of the file, which name another class
  grid.descriptor.gridClass = GridClass::kLevelSet;
  grid.descriptor.background = grid.volume.background = 1.0f;
  for (float& v : grid.volume.values) v = 1.0f - 2.0f * v;
  writeGrids(folder_ / "surface.vdb", {}, std::span(&grid, 1));
  const auto body = picture("surface.vdb");
  EXPECT_EQ(body.at(32, 24)[3], 255);
  EXPECT_THAT(body.corner(), ElementsAre(0, 0, 0, 0));
  const auto saved = folder_ / "tf.json";
  EXPECT_EQ(draw("surface.vdb", "again.png", {"--tf-save", saved}).exitCode, 0);
  EXPECT_EQ(picture("surface.vdb", {"--tf", saved, "--range", "own"}).rgba, body.rgba);
  for (const char* option : {"--colors", "--opacity"})
    EXPECT_NE(picture("surface.vdb", {option, option[2] == 'c' ? "viridis" : "linear"}).rgba,
              body.rgba);
  EXPECT_NE(picture("surface.vdb", {"--range", "data"}).rgba, body.rgba);
}

TEST_F(EsvrRender, IsTransparentAroundTheVolumeUnlessABackgroundIsGiven) {
  EXPECT_THAT(picture("in.esvr").corner(), ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(picture("in.esvr", {"--background", "1,0.5,0"}).corner(),
              ElementsAre(255, 128, 0, 255));
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

TEST_F(EsvrRender, ASavedTransferFunctionDrawsTheSame) {
  const auto first = picture(
      "in.esvr", {"--colors", "turbo", "--opacity", "tent", "--tf-save", folder_ / "tf.json"});
  const auto again = picture("in.esvr", {"--tf", folder_ / "tf.json", "--range", "own"});
  EXPECT_EQ(again.rgba, first.rgba);
}

TEST_F(EsvrRender, ModesAndBoxesChangeThePicture) {
  const auto whole = picture("in.esvr");
  EXPECT_NE(picture("in.esvr", {"--mode", "maximum"}).rgba, whole.rgba);
  EXPECT_NE(picture("in.esvr", {"--mode", "average"}).rgba, whole.rgba);
  EXPECT_NE(picture("in.esvr", {"--clip", "0,0,0,15,40,40"}).rgba, whole.rgba);
  EXPECT_EQ(
      picture("in.esvr", {"--slice", "y=15"}).rgba,
      picture("in.esvr", {"--clip", "-99,14.5,-99,99,15.5,99", "--classification", "post"}).rgba)
      << "the color of a slice is that of its values";
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

TEST_F(EsvrRender, TheClassificationChangesThePicture) {
  const auto usual = picture("in.esvr", {"--step", "3"});
  EXPECT_EQ(picture("in.esvr", {"--step", "3", "--classification", "pre"}).rgba, usual.rgba);
  EXPECT_NE(picture("in.esvr", {"--step", "3", "--classification", "post"}).rgba, usual.rgba);
  expectRefused({"--classification", "no"}, 2, "--classification");
}

TEST_F(EsvrRender, LevelsOfDetailChangePicturesOfWidePixels) {
  const std::vector<std::string> wide{"--orthographic", "--height", "600"};
  const auto drawn = [&](const std::string& lod) {
    auto more = wide;
    more.insert(more.end(), {"--lod", lod});
    return picture("in.esvr", more).rgba;
  };
  EXPECT_EQ(drawn("auto"), picture("in.esvr", wide).rgba) << "the default";
  EXPECT_NE(drawn("auto"), drawn("off"));
  EXPECT_EQ(picture("in.esvr", {"--lod", "off"}).rgba, picture("in.esvr").rgba) << "narrow pixels";
  expectRefused({"--lod", "3"}, 2, "--lod");
}

TEST_F(EsvrRender, ShadingChangesThePicture) {
  const auto usual = picture("in.esvr"), shaded = picture("in.esvr", {"--shade"});
  EXPECT_NE(shaded.rgba, usual.rgba);
  EXPECT_NE(picture("in.esvr", {"--shade", "--light", "0,0,1"}).rgba, shaded.rgba);
  EXPECT_GE(psnrOf(picture("in.vdb", {"--shade"}), shaded), 30.0);
  expectRefused({"--light", "0,0,1"}, 2, "--light needs --shade");
  expectRefused({"--shade", "--light", "0,0,0"}, 2, "must have a length");
  expectRefused({"--shade", "--mode", "average"}, 2, "--shade needs --mode composite");
  expectRefused({"--shade", "--between", "sum"}, 2, "cannot be shaded");
  expectRefused({"--shade", "--values", "fp8"}, 2, "leave --values out");
}

TEST_F(EsvrRender, PartsOfTheDepthAndMemoryChangeNothingOnGpu) {
  Device gpu;
  selectOrSkip("cuda", gpu);
  if (IsSkipped()) return;
  const auto usual = picture("in.esvr", {"--device", "cuda"});
  EXPECT_GE(psnrOf(picture("in.esvr", {"--device", "cuda", "--depth-parts", "3"}), usual), 48.0);
  EXPECT_GE(psnrOf(picture("in.esvr", {"--device", "cuda", "--max-vram", "1"}), usual), 48.0);
  // A row of tiles of the widest picture takes more than 1 MB.
  const auto refused = draw("in.esvr", "none.png",
                            {"--device", "cuda", "--max-vram", "0.001", "--resolution", "32767x8"});
  EXPECT_EQ(refused.exitCode, 5) << refused.err;
}

TEST_F(EsvrRender, TheNumberOfThreadsChangesNothing) {
  EXPECT_EQ(picture("in.esvr", {"--threads", "1"}).rgba, picture("in.esvr").rgba);
}

}  // namespace
}  // namespace esvr::test
