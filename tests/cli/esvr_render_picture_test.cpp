// Plan: pictures of a blob that must be equal or alike are compared with each other, and so are pictures
// that an option must change; cameras are tested by where the blob is in a picture. The folder golden/
// has the expected pictures of each method.

#include <cstdlib>

#include "cli/esvr_render_fixture.h"
#include "esvr/quantised.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST_F(EsvrRender, EllipsoidsLookLikeTheirVoxels) {
  // Bytes may differ by one. The background is black, because the color of an almost transparent
  // pixel is not well defined.
  const Words black{"--background", "0,0,0"};
  EXPECT_GE(psnrOf(picture("in.esvr", black), picture("in.vdb", black)), 60.0);
}

TEST_F(EsvrRender, TheSumIsShownBetweenVoxelsWhereAskedFor) {
  // Between the voxels of blobs with scales of 4 voxels, trilinear interpolation differs from the
  // sum by a few percent.
  const Words black{"--background", "0,0,0"};
  const Pixels sum = picture("in.esvr", {"--background", "0,0,0", "--between", "sum"});
  EXPECT_GE(psnrOf(sum, picture("in.vdb", black)), 35.0);
  EXPECT_NE(sum.rgba, picture("in.esvr", black).rgba);
  expectRefused({"--between", "nothing"}, 2, "--between");
}

TEST_F(EsvrRender, ValuesThatPicturesDoNotTellApartHaveAWarning) {
  const std::string warning = "its values are below 1.2e-38";
  VolumeGrid grid = readGrid(folder_ / "in.vdb", "density");
  for (const float factor : {1e-30f, 1e-10f}) {
    for (float& v : grid.volume.values) v *= factor;
    writeGrids(folder_ / "tiny.vdb", {}, std::span(&grid, 1), {.overwrite = true});
    const auto run = succeeded(draw("tiny.vdb", "tiny.png", {"-f"}));
    const bool isWarned = run.err.find(warning) != std::string::npos;
    EXPECT_EQ(isWarned, factor == 1e-10f) << "values of 1e-40 after the second factor";
  }
}

TEST_F(EsvrRender, ACutThatLeavesNothingHasAWarning) {
  const Box box = activeBox(readGrid(folder_ / "in.vdb", "density").volume);
  const auto at = [](const char* axis, int place) { return axis + std::to_string(place); };
  for (const Words& cut :
       {Words{"--slice", at("x=", box.max.x + 2)}, Words{"--slice", at("z=", box.min.z - 2)},
        Words{"--clip", "1000,0,0,1001,100,100"}})
    EXPECT_THAT(succeeded(draw("in.vdb", "cut.png", joined(cut, {"-f"}))).err,
                HasSubstr("a box outside its active voxels, " + toString(box.min)));
  for (const int place : {box.max.y, box.min.y})
    EXPECT_THAT(succeeded(draw("in.vdb", "cut.png", {"-f", "--slice", at("y=", place)})).err,
                Not(HasSubstr("nothing active is drawn")));
}

TEST_F(EsvrRender, AGridWithoutASumIsDrawnFromItsVoxelsWithAWarning) {
  const std::string warning = "--between sum has no effect";
  EXPECT_THAT(draw("in.vdb", "vdb.png", {"--between", "sum"}).err, HasSubstr(warning));
  EXPECT_THAT(draw("in.vdb", "plain.png").err, Not(HasSubstr(warning)));
  EXPECT_THAT(draw("in.esvr", "sum.png", {"--between", "sum"}).err, Not(HasSubstr(warning)));
  EXPECT_EQ(readPng(folder_ / "vdb.png").rgba, readPng(folder_ / "plain.png").rgba);
  for (const char* name : {"f.1.vdb", "f.2.vdb"})
    std::filesystem::copy_file(folder_ / "in.vdb", folder_ / name);
  const auto frames = succeeded(draw("f.@.vdb", "f.@.png", {"--between", "sum"}));
  EXPECT_EQ(timesIn(frames.err, warning), 1u) << "for all frames";
}

TEST_F(EsvrRender, AFileThatHoldsItsVoxelsIsDrawnFromThem) {
  const VolumeGrid grid = readGrid(folder_ / "in.vdb", "density");
  const VoxelLayer layer = exactLayer(grid.volume);
  writeEsvr(folder_ / "voxels.esvr", {{}, {makeStoredVoxels(grid.descriptor, grid.volume, layer)}});
  EXPECT_EQ(picture("voxels.esvr").rgba, picture("in.vdb").rgba);
}

// The mask leaves out half of the volume, which the ellipsoids alone would show.
TEST_F(EsvrRender, AStoredMaskIsDrawn) {
  EsvrFile file = readEsvr(folder_ / "in.esvr");
  StoredGrid& grid = file.grids[0];
  grid.topology = TopologyKind::kMask;
  grid.boxVoxels.clear();
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
  succeeded(draw("surface.vdb", "again.png", {"--tf-save", saved}));
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
  const Words wide{"--orthographic", "--height", "600"};
  const auto drawn = [&](const std::string& lod) {
    auto more = wide;
    return picture("in.esvr", joined(more, {"--lod", lod})).rgba;
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
  EXPECT_THAT(draw("in.esvr", "none.png",
                   {"--device", "cuda", "--max-vram", "0.001", "--resolution", "32767x8"}),
              Fails(5));
}

TEST_F(EsvrRender, TheNumberOfThreadsChangesNothing) {
  EXPECT_EQ(picture("in.esvr", {"--threads", "1"}).rgba, picture("in.esvr").rgba);
}

TEST_F(EsvrRender, TheMiddleOfTheVolumeIsInTheMiddleOfThePicture) {
  for (const char* input : {"in.esvr", "in.vdb"}) {
    EXPECT_GT(picture(input).at(32, 24)[3], 200) << input;
    EXPECT_GT(picture(input, {"--orthographic"}).at(32, 24)[3], 200) << input;
  }
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
  const Words same{"--eye", "-90,15,15", "--center", "15,15,15", "--up", "0,0,1", "--fov", "25"};
  EXPECT_EQ(file.rgba, picture("in.esvr", same).rgba);
  EXPECT_NE(picture("in.esvr", {"--camera", folder_ / "cam.json", "--fov", "50"}).rgba, file.rgba);
  writeText(folder_ / "flat.json", R"({"height": 60})");
  EXPECT_EQ(picture("in.esvr", {"--camera", folder_ / "flat.json"}).rgba,
            picture("in.esvr", {"--orthographic", "--height", "60"}).rgba);
}

TEST_F(EsvrRender, ATurntableWritesAPictureForEveryAngle) {
  succeeded(draw("in.esvr", "turn.png", {"--turntable", "3"}));
  EXPECT_THAT(folder_.names(),
              ElementsAre("in.esvr", "in.vdb", "turn.0000.png", "turn.0001.png", "turn.0002.png"));
  const auto first = readPng(folder_ / "turn.0000.png");
  succeeded(draw("in.esvr", "once.png", {"--turntable", "1"}));
  EXPECT_EQ(first.rgba, readPng(folder_ / "once.0000.png").rgba) << "the same distance";
  EXPECT_NE(first.rgba, readPng(folder_ / "turn.0001.png").rgba);
}

TEST_F(EsvrRender, SomeFramesOfATurntableAreThoseOfTheWhole) {
  succeeded(draw("in.esvr", "all.png", {"--turntable", "3"}));
  succeeded(draw("in.esvr", "part.png", {"--turntable", "3", "--frames", "1-1"}));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "part.0000.png"));
  EXPECT_EQ(readPng(folder_ / "part.0001.png").rgba, readPng(folder_ / "all.0001.png").rgba);
}

class EsvrRenderGrids : public EsvrRender {
 protected:
  EsvrRenderGrids() {
    const Field blob = readEsvr(folder_ / "in.esvr").grids.front().field;
    const Field hot = heatField();
    const SparseVolume density = revoxelise(blob, {}), heat = revoxelise(hot, {});
    writeEsvr(folder_ / "two.esvr", {{},
                                     {makeStoredGrid(named("density"), density, blob),
                                      makeStoredGrid(named("heat"), heat, hot),
                                      makeStoredGrid(named("moved", 2.0), heat, hot)}});
    const std::vector<VolumeGrid> grids{{named("density"), density, 0}, {named("heat"), heat, 0}};
    writeGrids(folder_ / "two.vdb", {}, grids);
  }
  static Field heatField() {
    Field field = randomField({.count = 5,
                               .extent = 16.0,
                               .smallest = 4.0,
                               .aspect = 2.0,
                               .origin = {24, 0, 0},
                               .seed = 3});
    for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
    return field;
  }
  static GridDescriptor named(const std::string& name, double voxel = 0.5) {
    GridDescriptor d = density();
    d.name = name;
    d.transform = uniformTransform(voxel);
    return d;
  }
  Pixels with(const std::string& look, const std::string& file = "two.esvr") {
    return picture(file, {"--with", look, "--opacity-length", "9", "--background", "0,0,0"});
  }
};

TEST_F(EsvrRenderGrids, LookAlikeFromBothFiles) {
  const auto run = succeeded(
      draw("two.esvr", "both.png",
           {"--with", "heat", "--ref", folder_ / "two.vdb", "--report", folder_ / "r.json"}));
  EXPECT_THAT(run.out + run.err, HasSubstr("density + heat"));
  const auto report = Json::parse(readText(folder_ / "r.json"));
  // The stored threshold decides about a few faint voxels.
  EXPECT_GT(report["comparisons"][0]["psnr"].get<double>(), 50.0);
}

TEST_F(EsvrRenderGrids, EachPartOfALookChangesThePicture) {
  writeText(folder_ / "red.json",
            R"([{"ColorSpace": "RGB", "Name": "Red", "RGBPoints": [0, 0.2, 0, 0, 1, 1, 0, 0]},
                {"ColorSpace": "RGB", "Name": "Blue", "RGBPoints": [0, 0, 0, 0.2, 1, 0, 0, 1]}])");
  const std::string tf = std::string("heat:tf=") + (folder_ / "red.json").string();
  std::vector<Pixels> pictures{
      picture("two.esvr", {"--opacity-length", "9", "--background", "0,0,0"})};
  for (const std::string& look :
       {std::string("heat"), std::string("heat:colors=viridis"), std::string("heat:opacity=tent"),
        std::string("heat:range=0,0.3"), std::string("heat:emission"), tf, tf + ":preset=Blue",
        tf + ":opacity=tent:emission"})
    pictures.push_back(with(look));
  for (std::size_t a = 0; a < pictures.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) EXPECT_NE(pictures[a].rgba, pictures[b].rgba) << a << b;
}

TEST_F(EsvrRenderGrids, EmissionIsThereInATransparentPicture) {
  const Words usual{"--opacity-length", "9"};
  auto glowing = usual;
  const Pixels plain = picture("two.esvr", usual),
               glow = picture("two.esvr", joined(glowing, {"--with", "heat:emission"}));
  // The fitted cameras differ by the box of the heat, so that only the sums are compared.
  const auto lit = [](const Pixels& p) {
    long sum = 0;
    for (std::size_t i = 3; i < p.rgba.size(); i += 4) sum += p.rgba[i];
    return sum;
  };
  EXPECT_GT(lit(glow), lit(plain));
}

TEST_F(EsvrRenderGrids, TheCameraSeesAllGrids) {
  const auto edge = [&](const Pixels& p) {
    bool lit = false;
    for (int row = 0; row < int(p.header.height); ++row)
      lit |= p.at(0, row)[3] > 0 || p.at(int(p.header.width) - 1, row)[3] > 0;
    return lit;
  };
  EXPECT_FALSE(edge(picture("two.esvr", {"--with", "heat"})));
}

TEST_F(EsvrRenderGrids, AreRefusedWhereTheyCannotBeDrawn) {
  const auto refused = [&](Words more, int code, const std::string& why) {
    EXPECT_THAT(draw("two.esvr", "refused.png", std::move(more)), Fails(code, why));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "refused.png"));
  };
  refused({"--with", "cold"}, 3, "cold");
  refused({"--with", "moved"}, 3, "different transforms");
  refused({"--with", ""}, 2, "name of a grid");
  refused({"--with", "heat:glow"}, 2, "'glow'");
  refused({"--with", "heat:colors="}, 2, "'colors='");
  refused({"--with", "heat:colors=jet"}, 2, "--with heat:colors=jet");
  refused({"--with", "heat:range=2,1"}, 2, "LO <= HI");
  refused({"--with", "heat", "--shade"}, 2, "--shade");
  refused({"--with", "heat", "--mode", "maximum"}, 2, "--mode");
  refused({"--with", "heat", "--between", "sum"}, 2, "--between");
  refused({"--with", "heat", "--values", "float"}, 2, "--values");
  refused({"--with", "heat", "--depth", folder_ / "z.exr"}, 2, "--depth");
  refused({"--with", "heat", "--with", "heat", "--with", "heat", "--with", "heat"}, 2, "3 times");
}

/// The options with which the blob is drawn.
struct Golden {
  const char *name, *input;
  Words options;
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
  const Pixels found =
      picture(GetParam().input, joined(options, {"--device", "cpu", "--resolution", "48x48"}));
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
    testing::Values(Golden{"default", "in.esvr", {}}, Golden{"voxels", "in.vdb", {}},
                    Golden{"sum", "in.esvr", {"--between", "sum", "--colors", "inferno"}},
                    Golden{"tent", "in.esvr", {"--opacity", "tent"}},
                    Golden{"post", "in.vdb", {"--classification", "post"}},
                    Golden{"maximum", "in.esvr", {"--mode", "maximum", "--background", "1,1,1"}},
                    Golden{"slice", "in.vdb", {"--slice", "z=15", "--opacity-length", "0.2"}},
                    Golden{"orthographic", "in.esvr", {"--orthographic", "--eye", "15,15,90"}}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace esvr::test
