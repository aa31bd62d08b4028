// Plan: the converters are run on splats as a user does. The splats of a ball come back as a density with its optical
// depth, in its place in the world; options change what they should; files that are hostile or of no use are refused
// with their exit codes, and leave nothing behind.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "cli/converters.h"
#include "esvr/container.h"
#include "esvr/splats.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using test::esvr2vdb;
using test::Refusal;
using test::vdb2esvr;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// A folder with a file of ellipsoids and its splats.
class SplatFiles : public test::FolderTest {
 protected:
  void SetUp() override {
    test::writeInput(at("in.vdb"), {{.voxels = test::softBall({20, -10, 5})}});
    ASSERT_EQ(test::quickFit(at("in.vdb"), at("in.esvr"), {"--tone", "off"}).exitCode, 0);
  }
  test::ProgramRun exportTo(const std::string& name, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {at("in.esvr"), at(name), "--force"});
    return esvr2vdb(more);
  }
};

double massOf(const std::string& path) {
  const VolumeGrid grid = readGrid(path, "density");
  const auto& m = *grid.descriptor.transform.affine;
  double sum = 0.0;
  for (std::size_t b = 0; b < grid.volume.brickCount(); ++b)
    for (const float v : grid.volume.brickValues(b)) sum += double(v);
  return sum * m[0] * m[5] * m[10];
}

TEST_F(SplatFiles, AreListed) {
  ASSERT_EQ(exportTo("out.ply", {"--colors", "0.8,0.4,0.2"}).exitCode, 0);
  const auto run = esvr2vdb({"--list", at("out.ply")});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const auto count = std::to_string(readSplats(at("out.ply")).inFile);
  EXPECT_THAT(run.out, testing::AllOf(HasSubstr("out.ply: splats, "), HasSubstr('\n' + count),
                                      HasSubstr("of degree 0"), HasSubstr("known")));
  test::writeText(at("bad.ply"), "ply\n");
  EXPECT_EQ(esvr2vdb({"--list", at("bad.ply")}).exitCode, 3);
}

TEST_F(SplatFiles, ComeBackAsADensityInItsPlace) {
  const auto out = exportTo("out.ply", {"--colors", "0.8,0.4,0.2"});
  ASSERT_EQ(out.exitCode, 0) << out.err;
  EXPECT_THAT(out.out + out.err, IsEmpty());
  const VolumeGrid source = readGrid(at("in.vdb"), "density");
  const auto& affine = *source.descriptor.transform.affine;
  const auto back =
      esvr2vdb({at("out.ply"), at("back.vdb"), "--voxel-size", std::to_string(affine[0])});
  ASSERT_EQ(back.exitCode, 0) << back.err;
  EXPECT_NEAR(massOf(at("back.vdb")), massOf(at("in.vdb")), 0.05 * massOf(at("in.vdb")));
  const VolumeGrid density = readGrid(at("back.vdb"), "density");
  const Box wanted = activeBox(source.volume), found = activeBox(density.volume);
  // The grid of splats has its voxel (0, 0, 0) at the origin of the world.
  const double shift = affine[12] / affine[0];
  EXPECT_NEAR(0.5 * (found.min.x + found.max.x), 0.5 * (wanted.min.x + wanted.max.x) + shift, 1.5);
  const VectorGrid color = readVector(at("back.vdb"), "Cd");
  const Coord middle{(found.min.x + found.max.x) / 2, (found.min.y + found.max.y) / 2,
                     (found.min.z + found.max.z) / 2};
  EXPECT_NEAR(valueAt(color.components[0], middle), 0.8, 0.01);
  EXPECT_NEAR(valueAt(color.components[2], middle), 0.2, 0.01);
}

TEST_F(SplatFiles, AreWrittenInEveryForm) {
  for (const auto& [name, more] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"a.ply", {}}, {"b.ply", {"--kind", "mitsuba"}}, {"c.usda", {"--up", "z"}}}) {
    const auto run = exportTo(name, more);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_GT(sizeOf(name), 1000u);
  }
  EXPECT_THAT(test::readText(at("a.ply")), Not(HasSubstr("property float nx")));
  EXPECT_THAT(test::readText(at("b.ply")), HasSubstr("property float nx"));
  EXPECT_THAT(test::readText(at("c.usda")), HasSubstr("upAxis = \"Z\""));
}

TEST_F(SplatFiles, HaveTheColorsAndTheDensityThatAreAskedFor) {
  ASSERT_EQ(exportTo("thin.ply", {"--density-scale", "0.1"}).exitCode, 0);
  ASSERT_EQ(exportTo("dense.ply", {"--density-scale", "0.4", "--colors", "inferno"}).exitCode, 0);
  const SplatScene thin = readSplats(at("thin.ply")).scene,
                   dense = readSplats(at("dense.ply")).scene;
  EXPECT_EQ(thin.densityScale, 0.1);
  EXPECT_LT(std::ranges::max(thin.splats.alpha), std::ranges::max(dense.splats.alpha));
  EXPECT_NE(thin.splats.color, dense.splats.color);
  test::writeText(at("preset.json"), R"([{"Name": "A", "RGBPoints": [0, 0, 0, 0, 1, 0, 0, 0.5]}])");
  ASSERT_EQ(exportTo("preset.ply", {"--colors", at("preset.json")}).exitCode, 0);
  EXPECT_NEAR(readSplats(at("preset.ply")).scene.splats.color[0][0], 0.0, 1e-6);
}

TEST_F(SplatFiles, AreSaidToBeWhatTheyAreWhereVerbose) {
  EXPECT_THAT(exportTo("out.ply", {"--verbose"}).err, HasSubstr("splats of 30 ellipsoids"));
  EXPECT_THAT(esvr2vdb({at("out.ply"), at("out.vdb"), "--voxel-size", "1", "--verbose"}).err,
              HasSubstr("voxels of the size"));
}

TEST_F(SplatFiles, AreConvertedLikeAVdb) {
  ASSERT_EQ(exportTo("out.ply").exitCode, 0);
  const auto run = vdb2esvr({at("out.ply"), at("out.esvr"), "--voxel-size", "1", "--preset",
                             "draft", "--scratch", folder_.path().string()});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr(at("out.ply")));
  EXPECT_THAT(namesInOrder(readEsvr(at("out.esvr"))), ElementsAre("density", "Cd"));
  EXPECT_THAT(folder_.names(),
              ElementsAre("in.esvr", "in.vdb", "out.esvr", "out.ply"));  // no scratch is left
}

TEST_F(SplatFiles, AreTakenFromAPipe) {
  ASSERT_EQ(exportTo("out.ply").exitCode, 0);
  const auto run =
      test::runProgram("/bin/sh", {"-c", "cat " + at("out.ply") + " | " + ESVR2VDB + " - " +
                                             at("piped.vdb") + " --voxel-size 1"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_GT(massOf(at("piped.vdb")), 0.0);
}

TEST_F(SplatFiles, AreTurnedAsTheUpwardAxisSays) {
  ASSERT_EQ(exportTo("out.ply").exitCode, 0);
  // Without our comments, a file has y down.
  std::string text = test::readText(at("out.ply"));
  while (text.find("comment esvr") != text.npos) {
    const auto begin = text.find("comment esvr");
    text.erase(begin, text.find('\n', begin) + 1 - begin);
  }
  test::writeText(at("plain.ply"), text);
  const auto middleOf = [&](const char* up) {
    EXPECT_EQ(esvr2vdb({at("plain.ply"), at("up.vdb"), "--up", up, "--voxel-size", "0.25", "-f"})
                  .exitCode,
              0);
    const Box box = activeBox(readGrid(at("up.vdb"), "density").volume);
    return Coord{box.min.x + box.max.x, box.min.y + box.max.y, box.min.z + box.max.z};
  };
  const Coord none = middleOf("none"), y = middleOf("y"), z = middleOf("z");
  EXPECT_EQ(y.y, -none.y);
  EXPECT_EQ(y.z, -none.z);
  EXPECT_EQ(z.y, none.z);
  EXPECT_EQ(z.z, -none.y);
}

TEST_F(SplatFiles, DropSplatsThatAreNotFiniteAndSaySo) {
  ASSERT_EQ(exportTo("out.ply").exitCode, 0);
  std::string bytes = test::readText(at("out.ply"));
  const float nan = std::nanf("");
  std::memcpy(bytes.data() + bytes.size() - 2 * sizeof(float), &nan, sizeof(float));
  test::writeText(at("nan.ply"), bytes);
  const auto run = esvr2vdb({at("nan.ply"), at("nan.vdb"), "--voxel-size", "1"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.err, HasSubstr("not finite"));
  EXPECT_THAT(run.err, HasSubstr("(1)"));
}

TEST_F(SplatFiles, RefuseWhatMakesNoSenseAndLeaveNothing) {
  ASSERT_EQ(exportTo("out.ply").exitCode, 0);
  const std::string text = test::readText(at("out.ply"));
  test::writeText(at("cut.ply"), text.substr(0, text.size() - 4));
  std::string many = text;
  many.replace(many.find("element vertex "), 15, "element vertex 9");
  test::writeText(at("many.ply"), many);
  std::string huge = text;  // a size of e^30
  const float size = 30.0f;
  for (int i = 0; i < 3; ++i)
    std::memcpy(huge.data() + huge.size() - std::size_t(5 + i) * sizeof(float), &size,
                sizeof(float));
  test::writeText(at("huge.ply"), huge);
  test::writeText(at("mesh.ply"),
                  "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n");
  ASSERT_EQ(vdb2esvr({at("in.vdb"), at("voxels.esvr"), "--lossless"}).exitCode, 0);
  for (const Refusal& refusal : {
           Refusal{{"DIR/cut.ply", "DIR/new.vdb"}, 3, "too short"},
           Refusal{{"DIR/many.ply", "DIR/new.vdb"}, 3, "too short"},
           Refusal{{"DIR/huge.ply", "DIR/new.vdb", "--voxel-size", "1"}, 3, "stray"},
           Refusal{{"DIR/mesh.ply", "DIR/new.vdb"}, 3, "no property y"},
           Refusal{{"DIR/voxels.esvr", "DIR/new.ply"}, 3, "--representation ellipsoids"},
           Refusal{{"DIR/out.ply", "DIR/new.ply"}, 2, "not converted to splats"},
           Refusal{{"DIR/out.ply", "DIR/new.vdb", "--lod", "1"}, 2, "--lod"},
           Refusal{{"DIR/in.esvr", "DIR/new.ply", "--threshold", "1"}, 2, "--threshold"},
           Refusal{{"DIR/in.esvr", "DIR/new.usda", "--kind", "mitsuba"}, 2, "--kind"},
           Refusal{{"DIR/in.esvr", "DIR/new.vdb", "--colors", "inferno"}, 2, "--colors"},
           Refusal{{"DIR/in.esvr", "DIR/new.ply", "--colors", "nocolor"}, 2, "nocolor"},
           Refusal{{"DIR/in.esvr", "DIR/new.ply", "--colors", "1,2,3"}, 2, "--colors"},
           Refusal{{"DIR/in.esvr", "DIR/new.ply", "--density-scale", "-1"}, 2, "--density-scale"},
           Refusal{{"DIR/in.esvr", "DIR/new.ply", "-g", "heat"}, 3, "heat"},
           Refusal{{"DIR/in.esvr", "DIR/out.ply"}, 1, "exists"},
       }) {
    SCOPED_TRACE(refusal);
    refusal.expectOf(esvr2vdb(refusal.argumentsIn(folder_)));
    EXPECT_FALSE(std::filesystem::exists(at("new.vdb")) || std::filesystem::exists(at("new.ply")));
  }
  const auto run = vdb2esvr({at("cut.ply"), at("new.esvr")});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_FALSE(std::filesystem::exists(at("new.esvr")));
  EXPECT_EQ(vdb2esvr({at("in.vdb"), at("new.esvr"), "--voxel-size", "1"}).exitCode, 2);
}

}  // namespace
}  // namespace esvr
