// Plan: the converters are run on splats as a user does. The splats of a ball come back as a density with its optical
// depth, in its place in the world; options change what they should; files that are hostile or of no use are refused
// with their exit codes, and leave nothing behind.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "cli/conversion.h"
#include "esvr/splats.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// A folder with a file of ellipsoids and its splats.
class SplatFiles : public FolderTest {
 protected:
  void SetUp() override {
    writeInput(at("in.vdb"), {{.voxels = softBall({20, -10, 5})}});
    succeeded(quickFit(at("in.vdb"), at("in.esvr"), "--tone off"));
  }
  ProgramRun exportTo(const std::string& name, const Words& more = {}) const {
    return esvr2vdb(joined({at("in.esvr"), at(name), "--force"}, more));
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
  succeeded(exportTo("out.ply", "--colors 0.8,0.4,0.2"));
  const auto run = succeeded(esvr2vdb({"--list", at("out.ply")}));
  const auto count = std::to_string(readSplats(at("out.ply")).inFile);
  EXPECT_THAT(run.out, Says("out.ply: splats, ", '\n' + count, "of degree 0", "known"));
  writeText(at("bad.ply"), "ply\n");
  EXPECT_THAT(esvr2vdb({"--list", at("bad.ply")}), Fails(3));
}

TEST_F(SplatFiles, ComeBackAsADensityInItsPlace) {
  const auto out = succeeded(exportTo("out.ply", "--colors 0.8,0.4,0.2"));
  EXPECT_THAT(out.out + out.err, IsEmpty());
  const VolumeGrid source = readGrid(at("in.vdb"), "density");
  succeeded(esvr2vdb({at("out.ply"), at("back.vdb")}));
  EXPECT_NEAR(massOf(at("back.vdb")), massOf(at("in.vdb")), 0.05 * massOf(at("in.vdb")));
  const VolumeGrid density = readGrid(at("back.vdb"), "density");
  EXPECT_EQ(density.descriptor.transform.affine, source.descriptor.transform.affine);
  const Box wanted = activeBox(source.volume), found = activeBox(density.volume);
  EXPECT_NEAR(0.5 * (found.min.x + found.max.x), 0.5 * (wanted.min.x + wanted.max.x), 1.5);
  const VectorGrid color = readVector(at("back.vdb"), "Cd");
  const Coord middle{(found.min.x + found.max.x) / 2, (found.min.y + found.max.y) / 2,
                     (found.min.z + found.max.z) / 2};
  EXPECT_NEAR(valueAt(color.components[0], middle), 0.8, 0.01);
  EXPECT_NEAR(valueAt(color.components[2], middle), 0.2, 0.01);
}

TEST_F(SplatFiles, AreWrittenInEveryForm) {
  for (const auto& [name, more] : std::vector<std::pair<std::string, Words>>{
           {"a.ply", {}}, {"b.ply", {"--kind", "mitsuba"}}, {"c.usda", {"--up", "z"}}}) {
    succeeded(exportTo(name, more));
    EXPECT_GT(sizeOf(name), 1000u);
  }
  EXPECT_THAT(readText(at("a.ply")), Not(HasSubstr("property float nx")));
  EXPECT_THAT(readText(at("b.ply")), HasSubstr("property float nx"));
  EXPECT_THAT(readText(at("c.usda")), HasSubstr("upAxis = \"Z\""));
}

TEST_F(SplatFiles, HaveTheColorsAndTheDensityThatAreAskedFor) {
  succeeded(exportTo("thin.ply", "--density-scale 0.1"));
  succeeded(exportTo("dense.ply", "--density-scale 0.4 --colors inferno"));
  const SplatScene thin = readSplats(at("thin.ply")).scene,
                   dense = readSplats(at("dense.ply")).scene;
  EXPECT_EQ(thin.densityScale, 0.1);
  EXPECT_LT(std::ranges::max(thin.splats.alpha), std::ranges::max(dense.splats.alpha));
  EXPECT_NE(thin.splats.color, dense.splats.color);
  writeText(at("preset.json"), R"([{"Name": "A", "RGBPoints": [0, 0, 0, 0, 1, 0, 0, 0.5]}])");
  succeeded(exportTo("preset.ply", {"--colors", at("preset.json")}));
  EXPECT_NEAR(readSplats(at("preset.ply")).scene.splats.color[0][0], 0.0, 1e-6);
}

TEST_F(SplatFiles, AreSaidToBeWhatTheyAreWhereVerbose) {
  EXPECT_THAT(exportTo("out.ply", "--verbose").err, HasSubstr("splats of 30 ellipsoids"));
  EXPECT_THAT(esvr2vdb({at("out.ply"), at("out.vdb"), "--voxel-size", "1", "--verbose"}).err,
              HasSubstr("voxels of the size"));
}

TEST_F(SplatFiles, AreConvertedLikeAVdb) {
  succeeded(exportTo("out.ply"));
  EXPECT_THAT(succeeded(vdb2esvr({at("out.ply"), at("out.esvr"), "--voxel-size", "1", "--preset",
                                  "draft", "--scratch", folder_.path().string()}))
                  .out,
              HasSubstr(at("out.ply")));
  EXPECT_THAT(namesInOrder(readEsvr(at("out.esvr"))), ElementsAre("density", "Cd"));
  EXPECT_THAT(folder_.names(),
              ElementsAre("in.esvr", "in.vdb", "out.esvr", "out.ply"));  // no scratch is left
}

TEST_F(SplatFiles, AreNamedByTheErrorsOfTheirGrids) {
  succeeded(exportTo("out.ply"));
  for (const auto& [more, code, why] : std::vector<std::tuple<Words, int, std::string>>{
           {"--voxel-size 1e-9", 3, "reaches beyond the index space"},
           {"--voxel-size 1e9", 3, "too faint for any active voxel of the size 1e+09"},
           {"--voxel-size 0.02 --max-memory 20KB", 3, "more voxels than there is memory for"}}) {
    EXPECT_THAT(esvr2vdb(joined({at("out.ply"), at("out.vdb")}, more)),
                Fails(code, at("out.ply"), why));
    EXPECT_THAT(vdb2esvr(joined({at("out.ply"), at("out.esvr")}, more)),
                Fails(code, at("out.ply"), why));
  }
}

TEST_F(SplatFiles, HaveTheSizeOfTheirFileInRatiosAndReports) {
  succeeded(exportTo("out.ply"));
  const std::string bytes = std::to_string(sizeOf("out.ply"));
  const std::string options = " --voxel-size 1 --preset draft --force --report " + at("r.json");
  const auto expectSize = [&](const ProgramRun& run) {
    EXPECT_THAT(succeeded(run).out, HasSubstr(" " + bytes + " bytes -> "));
    const auto report = nlohmann::json::parse(readText(at("r.json")));
    EXPECT_EQ(report["input"]["format"], "PLY");
    EXPECT_EQ(report["input"]["bytes"], sizeOf("out.ply"));
    EXPECT_EQ(report["input"]["bytes_converted"], sizeOf("out.ply"));
    EXPECT_EQ(report["ratio"], double(sizeOf("out.ply")) / double(sizeOf("out.esvr")));
  };
  const std::string command = std::string(VDB2ESVR) + " ";
  expectSize(runShell(command + at("out.ply") + " " + at("out.esvr") + options));
  expectSize(runShell(command + at("out.ply") + " " + at("out.esvr") + options + " --skip Cd"));
  expectSize(runShell(command + "- " + at("out.esvr") + options + " < " + at("out.ply")));
  succeeded(vdb2esvr({at("out.ply"), at("out.esvr"), "--voxel-size", "1", "--force", "--skip", "Cd",
                      "--ratio", "2"}));
  EXPECT_LE(2 * sizeOf("out.esvr"), sizeOf("out.ply"));
}

TEST_F(SplatFiles, AreTakenFromAPipe) {
  succeeded(exportTo("out.ply"));
  succeeded(runShell("cat " + at("out.ply") + " | " + ESVR2VDB + " - " + at("piped.vdb") +
                     " --voxel-size 1"));
  EXPECT_GT(massOf(at("piped.vdb")), 0.0);
  const std::string scratch = " --scratch " + folder_.path().string();
  for (const std::string command :
       {ESVR2VDB " - x.vdb", VDB2ESVR " - x.esvr", ESVR2VDB " --list -"})
    EXPECT_THAT(runShell("printf 'ply\\nformat ascii 1.0\\n' | " + command + scratch),
                Fails(3, ": standard input: its header has no end"));
  const auto run = runShell(std::string(VDB2ESVR) + " - " + at("piped.esvr") +
                            " -g nothing --voxel-size 1 --report " + at("r.json") + scratch +
                            " < " + at("out.ply"));
  EXPECT_THAT(run, Fails(3, "standard input"));
  EXPECT_THAT(run.err + readText(at("r.json")), Not(HasSubstr("esvr-s")));
}

TEST_F(SplatFiles, AreTurnedAsTheUpwardAxisSays) {
  succeeded(exportTo("out.ply"));
  // Without our comments, a file has y down.
  std::string text = readText(at("out.ply"));
  while (text.find("comment esvr") != text.npos) {
    const auto begin = text.find("comment esvr");
    text.erase(begin, text.find('\n', begin) + 1 - begin);
  }
  writeText(at("plain.ply"), text);
  const auto middleOf = [&](const char* up) {
    succeeded(esvr2vdb({at("plain.ply"), at("up.vdb"), "--up", up, "--voxel-size", "0.25", "-f"}));
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
  succeeded(exportTo("out.ply"));
  std::string bytes = readText(at("out.ply"));
  const float nan = std::nanf("");
  std::memcpy(bytes.data() + bytes.size() - 2 * sizeof(float), &nan, sizeof(float));
  writeText(at("nan.ply"), bytes);
  const auto run = succeeded(esvr2vdb({at("nan.ply"), at("nan.vdb"), "--voxel-size", "1"}));
  EXPECT_THAT(run.err, HasSubstr("not finite"));
  EXPECT_THAT(run.err, HasSubstr("(1)"));
}

TEST_F(SplatFiles, AreWrittenForFramesOfASequence) {
  for (const char* frame : {"41", "42"})
    writeInput(at("in." + std::string(frame) + ".vdb"), {{.voxels = softBall({20, -10, 5})}});
  succeeded(quickFit(at("in.##.vdb"), at("seq.esvr"), "--tone off"));
  succeeded(quickFit(at("in.##.vdb"), at("f.##.esvr"), "--tone off"));
  EXPECT_THAT(esvr2vdb({at("seq.esvr"), at("q.ply")}),
              Fails(2, "q.####.ply', or --frames names a single frame"));
  const auto run = succeeded(esvr2vdb({at("seq.esvr"), at("q.####.ply")}));
  EXPECT_THAT(run.err, Says("splats of each frame have their own middle and size", "--kind mitsuba",
                            "--density-scale", "--colors"));
  succeeded(esvr2vdb({at("seq.esvr"), at("one.ply"), "--frames", "42"}));
  EXPECT_EQ(readText(at("one.ply")), readText(at("q.0042.ply")));
  EXPECT_THAT(readText(at("q.0041.ply")), HasSubstr("element vertex"));
  const auto alike = succeeded(
      esvr2vdb({at("f.##.esvr"), at("u.##.usda"), "--density-scale", "0.3", "--colors", "1,1,1"}));
  EXPECT_THAT(alike.err, IsEmpty());
  EXPECT_THAT(readText(at("u.42.usda")), HasSubstr("ParticleField3DGaussianSplat"));
  succeeded(esvr2vdb({at("f.##.esvr"), at("one.vdb"), "--frames", "42"}));
  EXPECT_TRUE(std::filesystem::exists(at("one.vdb")));
  EXPECT_THAT(esvr2vdb({at("seq.esvr"), at("two.ply"), "--frames", "41-42"}), Fails(2, "####"));
  EXPECT_THAT(esvr2vdb({at("q.####.ply"), at("b.####.vdb")}), Fails(2, "one file at a time"));
  EXPECT_THAT(vdb2esvr({at("q.####.ply"), at("b.esvr")}), Fails(2, "one file at a time"));
}

TEST_F(SplatFiles, HaveLargeVoxelsOnlyWhereTheyAreAskedFor) {
  // Eight splats of another program that fill a cube.
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float "
      "z\nproperty float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float "
      "scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float "
      "rot_3\nend_header\n";
  for (const char* place : {"0 0 0", "0 0 9", "0 9 0", "0 9 9", "9 0 0", "9 0 9", "9 9 0", "9 9 9"})
    text += std::string(place) + " 2 1.2 1.2 1.2 1 0 0 0\n";
  writeText(at("other.ply"), text);
  EXPECT_THAT(succeeded(esvr2vdb({at("other.ply"), at("large.vdb")})).err,
              Says("million active voxels", "--voxel-size"));
  EXPECT_THAT(succeeded(esvr2vdb({at("other.ply"), at("small.vdb"), "--voxel-size", "0.5"})).err,
              IsEmpty());
}

TEST_F(SplatFiles, RefuseWhatMakesNoSenseAndLeaveNothing) {
  succeeded(exportTo("out.ply"));
  const std::string text = readText(at("out.ply"));
  writeText(at("cut.ply"), text.substr(0, text.size() - 4));
  std::string many = text;
  many.replace(many.find("element vertex "), 15, "element vertex 9");
  writeText(at("many.ply"), many);
  std::string huge = text;  // a size of e^30
  const float size = 30.0f;
  for (int i = 0; i < 3; ++i)
    std::memcpy(huge.data() + huge.size() - std::size_t(5 + i) * sizeof(float), &size,
                sizeof(float));
  writeText(at("huge.ply"), huge);
  writeText(at("mesh.ply"),
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n");
  succeeded(vdb2esvr({at("in.vdb"), at("voxels.esvr"), "--lossless"}));
  for (const Refusal& refusal : {
           Refusal{"DIR/cut.ply DIR/new.vdb", 3, "too short"},
           Refusal{"DIR/many.ply DIR/new.vdb", 3, "too short"},
           Refusal{"DIR/huge.ply DIR/new.vdb --voxel-size 1", 3, "stray"},
           Refusal{"DIR/mesh.ply DIR/new.vdb", 3, "no property y"},
           Refusal{"DIR/voxels.esvr DIR/new.ply", 3, "--representation ellipsoids"},
           Refusal{"DIR/out.ply DIR/new.ply", 2, "not converted to splats"},
           Refusal{"DIR/out.ply DIR/new.vdb --lod 1", 2, "--lod"},
           Refusal{"DIR/in.esvr DIR/new.ply --threshold 1", 2, "--threshold"},
           Refusal{"DIR/in.esvr DIR/new.usda --kind mitsuba", 2, "--kind"},
           Refusal{"DIR/in.esvr DIR/new.vdb --colors inferno", 2, "--colors"},
           Refusal{"DIR/in.esvr DIR/new.ply --colors nocolor", 2, "nocolor"},
           Refusal{"DIR/in.esvr DIR/new.ply --colors 1,2,3", 2, "--colors"},
           Refusal{"DIR/in.esvr DIR/new.ply --density-scale -1", 2, "--density-scale"},
           Refusal{"DIR/in.esvr DIR/new.ply -g heat", 3, "heat"},
           Refusal{"DIR/in.esvr DIR/new.ply --bbox 900,0,0,910,9,9", 3,
                   "in.esvr: grid \"density\" has nothing in the box of --bbox"},
           Refusal{"DIR/in.esvr DIR/out.ply", 1, "exists"},
       }) {
    SCOPED_TRACE(refusal);
    refusal.expectOf(esvr2vdb(refusal.argumentsIn(folder_)));
    EXPECT_FALSE(std::filesystem::exists(at("new.vdb")) || std::filesystem::exists(at("new.ply")));
  }
  const auto run = vdb2esvr({at("cut.ply"), at("new.esvr")});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_FALSE(std::filesystem::exists(at("new.esvr")));
  EXPECT_THAT(vdb2esvr({at("in.vdb"), at("new.esvr"), "--voxel-size", "1"}), Fails(2));
}

}  // namespace
}  // namespace esvr::test
