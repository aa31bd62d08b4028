/// Plan: every real file is read as its row in the data folder's README states. Counts and boxes
/// agree with the statistics that its writer stored. Written again, it is the same grid bit by bit,
/// including transform and metadata.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"
#include "esvr/vdb_io.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

using test::dataDir;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> uniqueNames(const VdbSummary& summary) {
  std::vector<std::string> names;
  for (const auto& grid : summary.grids) names.push_back(grid.uniqueName);
  return names;
}

struct RealFile {
  const char* path;
  std::uint64_t activeVoxels;
  std::size_t bricks;
  ValueType valueType;
  GridClass gridClass;
  const char* mapType;
};
std::ostream& operator<<(std::ostream& out, const RealFile& file) { return out << file.path; }

class RealFiles : public testing::TestWithParam<RealFile> {};

TEST_P(RealFiles, ReadAsTheirStatisticsSay) {
  ESVR_NEEDS_DATA();
  const auto path = dataDir() / GetParam().path;
  const auto summary = inspectVdb(path);
  ASSERT_EQ(summary.grids.size(), 1u);
  const auto& listed = summary.grids.front();
  EXPECT_EQ(summary.format, "OpenVDB");
  EXPECT_EQ(listed.skipReason, "");
  EXPECT_EQ(listed.activeVoxels, GetParam().activeVoxels);

  const auto grid = readGrid(path, listed.uniqueName);
  checkInvariants(grid.volume);
  EXPECT_EQ(activeVoxelCount(grid.volume), GetParam().activeVoxels);
  EXPECT_EQ(activeBox(grid.volume), listed.activeBox);
  EXPECT_EQ(grid.volume.brickCount(), GetParam().bricks);
  EXPECT_EQ(grid.descriptor.valueType, GetParam().valueType);
  EXPECT_EQ(grid.descriptor.gridClass, GetParam().gridClass);
  EXPECT_EQ(grid.descriptor.transform.mapType, GetParam().mapType);
  EXPECT_TRUE(grid.descriptor.transform.affine.has_value());
}

TEST_P(RealFiles, ComeBackAsTheyWere) {
  ESVR_NEEDS_DATA();
  const auto path = dataDir() / GetParam().path;
  const auto summary = inspectVdb(path);
  const auto grid = readGrid(path, summary.grids.front().uniqueName);
  const test::TemporaryFolder directory;
  writeGrids(directory / "back.vdb", summary.metadata, {&grid, 1});

  test::expectSame(readGrid(directory / "back.vdb", grid.descriptor.name), grid);
  const auto back = inspectVdb(directory / "back.vdb");
  EXPECT_THAT(back.metadata, testing::IsSupersetOf(summary.metadata));
  EXPECT_EQ(back.grids.front().activeVoxels, GetParam().activeVoxels);
  EXPECT_EQ(back.grids.front().activeBox, summary.grids.front().activeBox);
}

constexpr auto kFog = GridClass::kFogVolume;
INSTANTIATE_TEST_SUITE_P(
    Data, RealFiles,
    testing::Values(
        RealFile{"aneurism.vdb", 106773, 2891, ValueType::kFloat, kFog, "UniformScaleMap"},
        RealFile{"smoke1.vdb", 1049275, 3117, ValueType::kHalf, kFog, "UniformScaleTranslateMap"},
        RealFile{"wdas_cloud_sixteenth.vdb", 415642, 1371, ValueType::kFloat, kFog,
                 "UniformScaleMap"},
        RealFile{"dragon_with_xform.vdb", 156161, 679, ValueType::kFloat, kFog, "AffineMap"},
        RealFile{"cube_levelset.vdb", 1452218, 6812, ValueType::kHalf, GridClass::kLevelSet,
                 "UniformScaleMap"},
        RealFile{"hydrogen_atom.vdb", 686145, 1858, ValueType::kHalf, kFog, "UniformScaleMap"},
        RealFile{"neuron_m207.vdb", 549257, 7310, ValueType::kHalf, kFog, "UniformScaleMap"},
        RealFile{"neuron_rp140212.vdb", 398440, 6433, ValueType::kHalf, kFog, "UniformScaleMap"},
        RealFile{"edge/background_one.vdb", 9261, 64, ValueType::kFloat, kFog, "UniformScaleMap"},
        RealFile{"edge/double_grid.vdb", 524288, 1024, ValueType::kDouble, kFog,
                 "UniformScaleTranslateMap"}));

TEST(EdgeFiles, BackgroundOneIsTheValueOutsideTheBricks) {
  ESVR_NEEDS_DATA();
  const auto grid = readGrid(dataDir() / "edge/background_one.vdb", "density");
  EXPECT_EQ(grid.descriptor.background, 1.0);
  EXPECT_EQ(grid.volume.background, 1.0f);
  EXPECT_EQ(valueAt(grid.volume, {1000, 0, 0}), 1.0f);
}

TEST(EdgeFiles, ThreeGridsOfOneNameAreToldApartByNumber) {
  ESVR_NEEDS_DATA();
  const auto path = dataDir() / "edge/three_grids_named_density.vdb";
  EXPECT_THAT(uniqueNames(inspectVdb(path)), ElementsAre("density[0]", "density[1]", "density[2]"));
  EXPECT_EQ(activeVoxelCount(readGrid(path, "density[0]").volume), 491u);
  EXPECT_EQ(activeVoxelCount(readGrid(path, "density[1]").volume), 2222u);
  EXPECT_EQ(activeVoxelCount(readGrid(path, "density[2]").volume), 803u);
}

TEST(EdgeFiles, VectorsAndPointsAreListedWithTheirType) {
  ESVR_NEEDS_DATA();
  const auto vectors = inspectVdb(dataDir() / "edge/vec3_velocity.vdb");
  ASSERT_EQ(vectors.grids.size(), 1u);
  EXPECT_EQ(vectors.grids[0].name, "vel");
  EXPECT_THAT(vectors.grids[0].skipReason, HasSubstr("vec3s"));
  const auto points = inspectVdb(dataDir() / "edge/points_only.vdb");
  ASSERT_EQ(points.grids.size(), 1u);
  EXPECT_THAT(points.grids[0].skipReason, HasSubstr("ptdataidx32"));
  EXPECT_THROW((void)readGrid(dataDir() / "edge/points_only.vdb", "points"), BadInput);
}

TEST(EdgeFiles, AGridOpenVdbCannotReadDoesNotHideTheOthers) {
  ESVR_NEEDS_DATA();
  const auto path = dataDir() / "edge/unregistered_type.vdb";
  const auto summary = inspectVdb(path);
  EXPECT_THAT(uniqueNames(summary), ElementsAre("velocity", "phi_obstacle", "phi_inflow", "phi_out",
                                                "flags", "velocity_previous", "particles",
                                                "phi_particles", "phi", "phi_previous"));
  EXPECT_THAT(summary.grids[6].skipReason, HasSubstr("points"));
  EXPECT_EQ(activeVoxelCount(readGrid(path, "phi").volume), 18432u);
}

TEST(EdgeFiles, AFrameOfASequenceListsEveryGridInFileOrder) {
  ESVR_NEEDS_DATA();
  const auto summary = inspectVdb(dataDir() / "sequence/gas_0006.vdb");
  ASSERT_EQ(summary.grids.size(), 24u);
  EXPECT_EQ(summary.grids[0].name, "velocity");
  EXPECT_EQ(summary.grids[7].name, "density");
  EXPECT_EQ(summary.grids[7].activeVoxels, 19289u);
  EXPECT_THAT(summary.grids[10].skipReason, HasSubstr("no active voxel"));
}

TEST(EdgeFiles, HoudinisCreatorIsKept) {
  ESVR_NEEDS_DATA();
  const auto summary = inspectVdb(dataDir() / "smoke1.vdb");
  EXPECT_THAT(summary.metadata, ElementsAre(stringItem("creator", "Houdini/SOP_OpenVDB_Write")));
}

}  // namespace
}  // namespace esvr
