// Plan: Blender imports a file and the file that came back from .esvr. All that it shows of them is
// equal: names, types, transforms, bounds and the axis that points up. The surface of each grid of
// numbers, which Blender makes of its voxels, is at the same place. Where the voxels of a file are
// known, the surface is also compared with them.

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "blender/blender.h"
#include "cli/vdb_inputs.h"

namespace esvr {
namespace {

using nlohmann::json;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

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

class BlenderImport : public test::Blender {
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
  if (std::string(ESVR_DATA_DIR).empty())
    GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
  std::filesystem::copy(std::string(ESVR_DATA_DIR) + "/smoke1.vdb", at("in.vdb"));
  EXPECT_THAT(namesOf(importBoth(kBoundedError)), ElementsAre("density"));
}

TEST_F(BlenderImport, SlowRealFileOfBlenderIsShownAlike) {
  if (std::string(ESVR_DATA_DIR).empty())
    GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
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

}  // namespace
}  // namespace esvr
