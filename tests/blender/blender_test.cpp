// Plan: Blender runs without a window, and imports a file and the file that came back from .esvr. All that it shows of
// them is equal: names, types, transforms, bounds and the axis that points up. The surface of each grid of numbers, which
// Blender makes of its voxels, is at the same place. Where the voxels of a file are known, the surface is also compared
// with them.
//
// Frames with balls at different places are converted as a sequence, there and back. Blender finds all frames of the files
// that esvr2vdb wrote, in their order, and shows the bounds of the original frames.
//
// Cycles renders both files with the same camera, light and random numbers. The PSNR of the two pictures, with a peak of 1,
// is at least 40 dB. Each picture shows something: a black one is far from it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/conversion.h"
#include "cli/run_program.h"
#include "support/machine.h"
#include "vdb/foreign_grids.h"

namespace esvr {
namespace {

using nlohmann::json;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

/// Skips where Blender is not installed.
class Blender : public test::FolderTest {
 protected:
  void SetUp() override {
    if (std::string(ESVR_BLENDER).empty()) GTEST_SKIP() << "blender is not installed";
  }
  /// Runs a script of this folder.
  static void runScript(const std::string& name, const std::vector<std::string>& arguments) {
    std::vector<std::string> words{"--background",
                                   "--factory-startup",
                                   "--python-exit-code",
                                   "1",
                                   "--python",
                                   std::string(ESVR_SOURCE_DIR) + "/tests/blender/" + name,
                                   "--"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const test::ProgramRun run = test::runProgram(ESVR_BLENDER, words);
    ASSERT_EQ(run.exitCode, 0) << run.out << run.err;
  }
  /// What Blender knows of volumes (import_facts.py).
  [[nodiscard]] nlohmann::json facts(std::vector<std::string> files) const {
    files.insert(files.begin(), at("facts.json"));
    runScript("import_facts.py", files);
    return nlohmann::json::parse(test::readText(at("facts.json")));
  }
  void makeSample(const std::string& kind, const std::string& resolution) const {
    const auto run =
        test::runProgram(ESVR_SAMPLE, {kind, at("in.vdb"), "--resolution", resolution, "--force"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
  /// Converts `source` with options of vdb2esvr, and back to back.vdb.
  void convertThereAndBack(const std::string& source, std::vector<std::string> options) const {
    options.insert(options.begin(), {source, at("in.esvr")});
    const auto there = test::vdb2esvr(options);
    ASSERT_EQ(there.exitCode, 0) << there.err;
    const auto back = test::esvr2vdb({at("in.esvr"), at("back.vdb")});
    ASSERT_EQ(back.exitCode, 0) << back.err;
  }
};

// Imports.

/// Voxels are stored in the bounds of the source; values change a little.
const std::vector<std::string> kExactBounds{"--topology", "exact"};

/// For grids whose largest value is so large that 40 dB would leave little of the others.
const std::vector<std::string> kBoundedError{"--topology",       "exact", "--max-error", "0.01",
                                             "--representation", "voxels"};

using Point = std::array<double, 3>;
Point pointOf(const json& values) { return values.get<Point>(); }

/// The length of a voxel, which is the longest column of the matrix.
double voxelOf(const json& grid) {
  double longest = 0.0;
  for (int column = 0; column < 3; ++column) {
    double squares = 0.0;
    for (int row = 0; row < 3; ++row)
      squares += std::pow(grid["matrix_object"][row][column].get<double>(), 2);
    longest = std::max(longest, std::sqrt(squares));
  }
  return longest;
}

/// Where a preset of 40 dB changes values by about a hundredth of the peak, a surface at the flank
/// of a volume moves by much less than a voxel. Its outermost points may move by a voxel.
void expectSameSurfaces(const json& back, const json& source) {
  for (std::size_t g = 0; g < source["grids"].size(); ++g) {
    const json &a = source["grids"][g], &b = back["grids"][g];
    ASSERT_EQ(b["surface"].is_null(), a["surface"].is_null()) << a << b;
    if (a["surface"].is_null()) continue;  // of vectors, and of grids without large values
    for (const char* point : {"min", "max", "center"})
      EXPECT_THAT(pointOf(b["surface"][point]),
                  Pointwise(DoubleNear(voxelOf(a)), pointOf(a["surface"][point])))
          << a["name"] << ' ' << point;
  }
}

bool hasSurface(const json& facts) {
  return std::any_of(facts["grids"].begin(), facts["grids"].end(),
                     [](const json& grid) { return !grid["surface"].is_null(); });
}

json withoutSurfaces(json facts) {
  for (json& grid : facts["grids"]) grid.erase("surface");
  return facts;
}

std::vector<std::string> namesOf(const json& facts) {
  std::vector<std::string> names;
  for (const json& grid : facts["grids"]) names.push_back(grid["name"]);
  return names;
}

class BlenderImport : public Blender {
 protected:
  /// The facts of in.vdb, after those of back.vdb have been compared with them.
  json importBoth(const std::vector<std::string>& options = kExactBounds) const {
    convertThereAndBack(at("in.vdb"), options);
    const json both = facts({at("in.vdb"), at("back.vdb")});
    EXPECT_EQ(both[0]["error"], "");
    EXPECT_EQ(withoutSurfaces(both[1]), withoutSurfaces(both[0]));
    EXPECT_TRUE(hasSurface(both[0]));
    expectSameSurfaces(both[1], both[0]);
    return both[0];
  }
};

TEST_F(BlenderImport, SlowShowsTwoGridsWithTheirTransforms) {
  makeSample("two-grids", "48");
  const json shown = importBoth();
  EXPECT_THAT(namesOf(shown), ElementsAre("density", "temperature"));
  EXPECT_NE(shown["grids"][0]["matrix_object"], shown["grids"][1]["matrix_object"]);
}

TEST_F(BlenderImport, SlowShowsALevelSet) {
  makeSample("levelset", "40");
  EXPECT_THAT(namesOf(importBoth()), ElementsAre("surface"));
}

TEST_F(BlenderImport, SlowShowsVectorsAsOneGridForMotionBlur) {
  test::writeVectorInput(at("in.vdb"), {.voxels = test::cloud(12)},
                         {{.voxels = test::cloud(12), .map = test::InputMap::kSheared}});
  const json shown = importBoth();
  EXPECT_THAT(namesOf(shown), ElementsAre("density", "velocity"));  // Blender sorts them by name
  EXPECT_EQ(shown["grids"][1]["data_type"], "VECTOR_FLOAT");
  EXPECT_EQ(shown["velocity_grid"], "velocity");
}

TEST_F(BlenderImport, SlowRealFileOfHoudiniIsShownAlike) {
  ESVR_NEEDS_DATA();
  std::filesystem::copy(std::string(ESVR_DATA_DIR) + "/smoke1.vdb", at("in.vdb"));
  EXPECT_THAT(namesOf(importBoth(kBoundedError)), ElementsAre("density"));
}

TEST_F(BlenderImport, SlowRealFileOfBlenderIsShownAlike) {
  ESVR_NEEDS_DATA();
  std::filesystem::copy(std::string(ESVR_DATA_DIR) + "/sequence/gas_0006.vdb", at("in.vdb"));
  const json shown = importBoth(kBoundedError);
  EXPECT_EQ(shown["grids"].size(), 24u);  // numbers, vectors, integers and empty grids
  EXPECT_EQ(shown["velocity_grid"], "velocity");
}

/// A ball at the origin and one on each axis, at different distances.
std::vector<test::InputVoxel> ballsOnAxes() {
  std::vector<test::InputVoxel> voxels;
  for (const Coord center : {Coord{}, Coord{20, 0, 0}, Coord{0, 40, 0}, Coord{0, 0, 12}})
    for (const auto& voxel : test::softBall(center)) voxels.push_back(voxel);
  return voxels;
}

TEST_F(BlenderImport, SlowTurnsTheYAxisOfHoudiniUp) {
  test::writeInput(at("in.vdb"), {{.voxels = ballsOnAxes()}});
  const json shown = importBoth();
  const json surface = shown["grids"][0]["surface"];
  // Blender's up is z. A turn by 90 degrees about x takes (x, y, z) of the file to (x, -z, y). The
  // value of a ball is 1 - d^2 / 25, so that it is 0.4, the value at the surface, at 3.87 voxels.
  constexpr double kVoxel = 0.25, kRadius = 3.87 * kVoxel;
  const auto near = [](double x, double y, double z) {
    return Pointwise(DoubleNear(kVoxel), Point{x, y, z});
  };
  EXPECT_THAT(pointOf(surface["min"]), near(-kRadius, -12 * kVoxel - kRadius, -kRadius));
  EXPECT_THAT(pointOf(surface["max"]), near(20 * kVoxel + kRadius, kRadius, 40 * kVoxel + kRadius));
}

TEST_F(BlenderImport, SlowLeavesTheZAxisOfOtherFilesUp) {
  makeSample("plume", "40");
  EXPECT_EQ(importBoth()["matrix_world"], json::parse("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"));
}

// Sequences.

using BlenderSequence = Blender;

TEST_F(BlenderSequence, SlowIsFoundWithAllFrames) {
  constexpr int kBrick = 8;
  for (const int frame : {7, 8, 9})
    test::writeInput(at("in.000" + std::to_string(frame) + ".vdb"),
                     {{.voxels = test::softBall({frame * kBrick, 0, 0})}});
  const auto there = test::vdb2esvr({at("in.####.vdb"), at("in.####.esvr")});
  ASSERT_EQ(there.exitCode, 0) << there.err;
  const auto back = test::esvr2vdb({at("in.####.esvr"), at("smoke.####.vdb")});
  ASSERT_EQ(back.exitCode, 0) << back.err;

  const auto both = facts({at("in.####.vdb"), at("smoke.####.vdb")});
  const auto &source = both[0]["sequence"], &shown = both[1]["sequence"];
  EXPECT_EQ(shown["is_sequence"], true);
  EXPECT_EQ(shown["frame_duration"], 3);
  EXPECT_EQ(shown["frame_start"], source["frame_start"]);
  EXPECT_EQ(shown["frame_offset"], source["frame_offset"]);
  ASSERT_EQ(shown["frames"].size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(shown["frames"][i]["file"], "smoke.000" + std::to_string(7 + i) + ".vdb");
    EXPECT_EQ(shown["frames"][i]["error"], "");
    EXPECT_EQ(shown["frames"][i]["bound_box"], source["frames"][i]["bound_box"]);
  }
  EXPECT_NE(shown["frames"][0]["bound_box"], shown["frames"][2]["bound_box"]);
}

// Pictures.

class BlenderPicture : public Blender {
 protected:
  /// Converts a file there and back, and compares its picture with that of the result.
  /// \param grid  as for render_pictures.py
  void expectSamePicture(const std::string& source, const std::string& grid,
                         const std::vector<std::string>& options) {
    convertThereAndBack(source, options);
    runScript("render_pictures.py",
              {at("psnr.json"), grid, source, at("source.exr"), at("back.vdb"), at("back.exr")});
    const auto figures = nlohmann::json::parse(test::readText(at("psnr.json")));
    constexpr double kVisible = 20.0;  // dB; a tenth of the peak over the whole picture
    EXPECT_LT(figures["psnr_of_black"], kVisible);
    EXPECT_GE(figures["psnr"][0], 40.0);
    RecordProperty("psnr", figures["psnr"][0].dump());
  }
};

TEST_F(BlenderPicture, SlowOfAPlumeIsTheSame) {
  makeSample("plume", "48");
  expectSamePicture(at("in.vdb"), "density", {});
}

TEST_F(BlenderPicture, SlowOfVectorsIsTheSame) {
  auto voxels = test::cloud(12);
  for (const auto& voxel : test::softBall({30, 0, 0})) voxels.push_back(voxel);
  test::writeVectorInput(at("in.vdb"), {.voxels = voxels},
                         {{.voxels = voxels, .map = test::InputMap::kRotated}});
  expectSamePicture(at("in.vdb"), "velocity", {});
}

TEST_F(BlenderPicture, SlowOfRealFileIsTheSame) {
  ESVR_NEEDS_DATA();
  // The values reach 5.7, but smoke of a hundredth is visible. A bound keeps it.
  expectSamePicture(std::string(ESVR_DATA_DIR) + "/smoke1.vdb", "density",
                    {"--max-error", "0.01", "--representation", "voxels"});
}

}  // namespace
}  // namespace esvr
