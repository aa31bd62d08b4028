// Plan: a separate process draws a density together with a heat that has other voxels. The pictures of
// the .esvr file and of the VDB file agree; each part of a look changes the picture; a grid that
// emits hides nothing; what several grids do not have is refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/esvr_render_fixture.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

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
  const auto run =
      draw("two.esvr", "both.png",
           {"--with", "heat", "--ref", folder_ / "two.vdb", "--report", folder_ / "r.json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out + run.err, HasSubstr("density + heat"));
  const auto report = nlohmann::json::parse(readText(folder_ / "r.json"));
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
  const std::vector<std::string> usual{"--opacity-length", "9"};
  auto glowing = usual;
  glowing.insert(glowing.end(), {"--with", "heat:emission"});
  const Pixels plain = picture("two.esvr", usual), glow = picture("two.esvr", glowing);
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
  const auto refused = [&](std::vector<std::string> more, int code, const std::string& why) {
    const auto run = draw("two.esvr", "refused.png", std::move(more));
    EXPECT_EQ(run.exitCode, code) << run.err;
    EXPECT_THAT(run.err, HasSubstr(why));
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

}  // namespace
}  // namespace esvr::test
