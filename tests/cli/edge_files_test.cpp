// Plan: both programs process every file of the data folder's edge cases, with the results that
// their rows in its README state. A file has the metadata that Houdini writes: the items that it
// shows as intrinsics of a primitive (class, creator, is_local_space, is_saved_as_half_float,
// value_type, vector_type), the name, primitive attributes of several types, and the statistics
// file_*. After a conversion there and back, OpenVDB reads the same items and the same transform.
// The statistics are those of the new voxels.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/converters.h"
#include "cli/run_program.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/metrics.h"
#include "esvr/quantised.h"
#include "esvr/vdb_io.h"
#include "vdb/foreign_grids.h"
#include "vdb/open_vdb.h"

#include <openvdb/io/File.h>

namespace esvr {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Fits a real file and decodes it.
class EdgeFile : public testing::Test {
 protected:
  void SetUp() override {
    if (std::string(ESVR_DATA_DIR).empty())
      GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
  }
  [[nodiscard]] static std::string path(const std::string& name) {
    return std::string(ESVR_DATA_DIR) + "/edge/" + name;
  }
  [[nodiscard]] test::ProgramRun fit(const std::string& name) const {
    return test::quickFit(path(name), folder_ / "out.esvr");
  }
  [[nodiscard]] VdbSummary back() const {
    const auto run = test::esvr2vdb({folder_ / "out.esvr", folder_ / "back.vdb"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return inspectVdb(folder_ / "back.vdb");
  }
  /// Expects that the only grid of a file comes back bit for bit, with a warning.
  void expectCarried(const std::string& name) const {
    const auto run = fit(name);
    EXPECT_EQ(run.exitCode, 0);
    EXPECT_THAT(run.err, HasSubstr("no grid is fitted; the output has carried grids only"));
    ASSERT_EQ(back().grids.size(), 1u);
    const std::size_t place = 0;
    EXPECT_EQ(test::withoutVersion(readCarried(folder_ / "back.vdb", {&place, 1})),
              test::withoutVersion(readCarried(path(name), {&place, 1})));
  }

  test::TemporaryFolder folder_;
};

std::vector<std::string> namesOf(const VdbSummary& summary) {
  std::vector<std::string> names;
  for (const auto& grid : summary.grids) names.push_back(grid.uniqueName);
  return names;
}

TEST_F(EdgeFile, RealFileOfBackgroundOneKeepsIt) {
  ASSERT_EQ(fit("background_one.vdb").exitCode, 0);
  ASSERT_EQ(back().grids.size(), 1u);
  EXPECT_EQ(readGrid(folder_ / "back.vdb", "density").volume.background, 1.0f);
}

TEST_F(EdgeFile, RealFileOfThreeGridsOfOneNameGivesThemBackInOrder) {
  ASSERT_EQ(fit("three_grids_named_density.vdb").exitCode, 0);
  EXPECT_THAT(namesOf(back()), ElementsAre("density[0]", "density[1]", "density[2]"));
}

TEST_F(EdgeFile, RealFileOfDoublesComesBackAsDoubles) {
  ASSERT_EQ(fit("double_grid.vdb").exitCode, 0);
  EXPECT_EQ(back().grids.at(0).valueType, "double");
}

TEST_F(EdgeFile, RealFileOfAMillionVectorsIsSmallestUnchanged) {
  const auto run = test::vdb2esvr({path("vec3_velocity.vdb"), folder_ / "out.esvr"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("vel: carried unchanged, because its components would take"));
  EXPECT_EQ(back().grids.at(0).activeVoxels, 1'000'000u);
}

TEST_F(EdgeFile, RealFileOfAMillionVectorsIsFittedWhereEllipsoidsAreAskedFor) {
  ASSERT_EQ(fit("vec3_velocity.vdb").exitCode, 0);
  EXPECT_TRUE(back().grids.at(0).isVector);
}

/// Converts a file of edge/faults or edge/faults2 there and back.
class FaultFile : public EdgeFile {
 protected:
  test::ProgramRun throughTheFile(const std::string& name,
                                  std::vector<std::string> options = {}) const {
    options.insert(options.begin(), {path(name), folder_ / "out.esvr", "--force"});
    const auto run = test::vdb2esvr(options);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    const auto decode = test::esvr2vdb({folder_ / "out.esvr", folder_ / "back.vdb", "--force"});
    EXPECT_EQ(decode.exitCode, 0) << decode.err;
    return run;
  }
  [[nodiscard]] VolumeGrid read(const std::string& file) const {
    return readGrid(file, inspectVdb(file).grids.at(0).uniqueName);
  }
  [[nodiscard]] VolumeGrid readBack() const { return read(folder_ / "back.vdb"); }
};

TEST_F(FaultFile, RealFileOfALevelSetWithAnotherInsideIsKeptByLossless) {
  const auto run = throughTheFile("faults/levelset_inside_minus2.vdb", {"--lossless"});
  EXPECT_THAT(run.out, HasSubstr("2109 inactive values (-2"));
  EXPECT_EQ(readBack().inactive, read(path("faults/levelset_inside_minus2.vdb")).inactive);
}

TEST_F(FaultFile, RealFileOfTwoInactiveValuesIsKeptByLosslessAndToldOtherwise) {
  throughTheFile("faults/inactive_values.vdb", {"--lossless"});
  EXPECT_EQ(readBack().inactive.count(), 2u);
  EXPECT_THAT(throughTheFile("faults/inactive_values.vdb").out,
              HasSubstr("gives up 2 inactive values (5, first at"));
}

TEST_F(FaultFile, RealFileOfHalfsKeepsItsBound) {
  throughTheFile("faults/half.vdb", {"--max-error", "0.0003"});
  EXPECT_LE(largestDifference(read(path("faults/half.vdb")).volume, readBack().volume), 0.0003);
}

TEST_F(FaultFile, RealFileOfTheLargestHalfsComesBack) {
  throughTheFile("faults2/half_maximum.vdb");
  EXPECT_LE(activeRange(readBack().volume).max, 65504.0f);
}

TEST_F(FaultFile, RealFileOfAGiantTileIsRefusedOrCarried) {
  const auto run =
      test::vdb2esvr({path("faults/root_tile.vdb"), folder_ / "out.esvr", "--max-memory", "8GB"});
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_THAT(run.err, HasSubstr("--keep"));
  throughTheFile("faults/root_tile.vdb",
                 {"--keep", inspectVdb(path("faults/root_tile.vdb")).grids.at(0).uniqueName});
}

TEST_F(FaultFile, RealFileOfConstantLeavesKeepsThemForBlender) {
  throughTheFile("faults2/dense_leaves.vdb");
  openvdb::initialize();
  openvdb::io::File file(folder_ / "back.vdb");
  file.open();
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
  EXPECT_EQ(grid->tree().leafCount(), 8u);
  EXPECT_EQ(grid->activeVoxelCount(), 8u * kBrickVoxels);
}

TEST_F(EdgeFile, RealFileOfPointsIsCarried) { expectCarried("points_only.vdb"); }

TEST_F(EdgeFile, RealFileWithATypeThatOpenVdbCannotReadGivesAllItsGrids) {
  const auto run = fit("unregistered_type.vdb");
  ASSERT_EQ(run.exitCode, 0) << run.err;
  for (const char* carried : {"flags", "particles"})
    EXPECT_THAT(run.out, HasSubstr(std::string(carried) + ": carried unchanged"));
  EXPECT_THAT(namesOf(back()), ElementsAre("velocity", "phi_obstacle", "phi_inflow", "phi_out",
                                           "flags", "velocity_previous", "particles",
                                           "phi_particles", "phi", "phi_previous"));
}

/// Converts a file there and back, with the default goal and given options.
class ComparedFaultFile : public EdgeFile {
 protected:
  [[nodiscard]] std::string source(const std::string& name) const { return path("faults/" + name); }
  void convertThereAndBack(const std::string& name, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {source(name), folder_ / "out.esvr", "--force"});
    const auto there = test::vdb2esvr(more);
    ASSERT_EQ(there.exitCode, 0) << there.err;
    const auto run = test::esvr2vdb({folder_ / "out.esvr", folder_ / "back.vdb", "--force"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
  [[nodiscard]] test::ProgramRun check(const std::string& name, const std::string& candidate,
                                       std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"check", source(name), folder_ / candidate});
    return test::runProgram(ESVR_COMPARE, more);
  }
};

TEST_F(ComparedFaultFile, RealFileOfAnOffsetPressureHasTheQualityOfItsRange) {
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{}, {"--representation", "ellipsoids", "--count", "300"}}) {
    convertThereAndBack("pressure_offset.vdb", options);
    const VolumeGrid a = readGrid(source("pressure_offset.vdb"), "p");
    const VolumeGrid b = readGrid(folder_ / "back.vdb", "p");
    EXPECT_LT(peakOf(a.volume), 41.0);
    const VolumeMetrics m = compareVolumes(a.volume, b.volume);
    EXPECT_GE(m.psnrActive, options.empty() ? 40.0 : 20.0);
    EXPECT_EQ(activeBox(b.volume), activeBox(a.volume));
    EXPECT_GE(activeRange(b.volume).min, a.volume.background - 1.0f);
    EXPECT_EQ(b.volume.background, a.volume.background);
  }
}

TEST_F(ComparedFaultFile, RealFileOfVectorsKeepsAPercentageForTheCheckToo) {
  convertThereAndBack("vector.vdb", {"--max-error", "1%"});
  for (const char* candidate : {"out.esvr", "back.vdb"}) {
    const auto run = check("vector.vdb", candidate, {"--max-error", "1%"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
  }
}

TEST_F(ComparedFaultFile, RealFileWithAGridOfZerosIsComparedWithItself) {
  const std::string zeros = source("all_zero_flame.vdb");
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, {"check", zeros, zeros}).exitCode, 0);
  convertThereAndBack("all_zero_flame.vdb");
  EXPECT_EQ(check("all_zero_flame.vdb", "back.vdb").exitCode, 0);
}

TEST_F(ComparedFaultFile, RealFileOfARootTileIsComparedByItsBytes) {
  const std::string tile = source("root_tile.vdb");
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, {"check", tile, tile}).exitCode, 0);
}

using openvdb::GridBase;

/// Adds metadata of the types in which Houdini stores primitive attributes.
void addAttributes(GridBase& grid) {
  grid.insertMeta("value_type", openvdb::StringMetadata(grid.valueType()));
  grid.insertMeta("shop_materialpath", openvdb::StringMetadata("/mat/smoke"));
  grid.insertMeta("Cd", openvdb::Vec3SMetadata({1.0f, 0.5f, 0.25f}));
  grid.insertMeta("frame", openvdb::Int64Metadata(1001));
  grid.insertMeta("dt", openvdb::DoubleMetadata(1.0 / 24.0));
  grid.insertMeta("is_source", openvdb::BoolMetadata(true));
}

template <class Grid>
GridBase::Ptr gridOfHoudini(const char* name, const typename Grid::ValueType& unit) {
  const auto grid = Grid::create();
  grid->setName(name);
  grid->setCreator("Houdini/GEO_VDBTranslator");
  grid->setIsInWorldSpace(false);
  const auto transform = openvdb::math::Transform::createLinearTransform(0.1);
  transform->postTranslate({0.05, -3.0, 0.05});
  grid->setTransform(transform);
  auto accessor = grid->getAccessor();
  for (const auto& [at, value] : test::cloud(10))
    accessor.setValue({at.x, at.y + 40, at.z}, unit * value);
  addAttributes(*grid);
  return grid;
}

class HoudiniFile : public test::FolderTest {
 protected:
  void SetUp() override {
    openvdb::initialize();
    const auto density = gridOfHoudini<openvdb::FloatGrid>("density", 1.0f);
    density->setGridClass(openvdb::GRID_FOG_VOLUME);
    density->setSaveFloatAsHalf(true);
    const auto velocity = gridOfHoudini<openvdb::Vec3SGrid>("vel", {1.0f, -0.5f, 0.25f});
    velocity->setVectorType(openvdb::VEC_COVARIANT);
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata("Houdini/GEO_VDBTranslator"));
    openvdb::io::File(at("in.vdb")).write(openvdb::GridPtrVec{density, velocity}, metadata);
    const auto there = test::vdb2esvr({at("in.vdb"), at("in.esvr"), "--topology", "exact"});
    ASSERT_EQ(there.exitCode, 0) << there.err;
    ASSERT_TRUE(readEsvr(at("in.esvr")).carried.empty());  // both grids are coded anew
    const auto back = test::esvr2vdb({at("in.esvr"), at("back.vdb")});
    ASSERT_EQ(back.exitCode, 0) << back.err;
  }
  [[nodiscard]] GridBase::Ptr read(const std::string& file, const std::string& name) const {
    openvdb::io::File opened(at(file));
    opened.open(false);
    return opened.readGrid(name);
  }
};

class HoudiniGrid : public HoudiniFile, public testing::WithParamInterface<const char*> {};

TEST_P(HoudiniGrid, KeepsEveryItemAndAddsNone) {
  const auto source = read("in.vdb", GetParam()), back = read("back.vdb", GetParam());
  const auto withoutStatistics = [](const GridBase& grid) {
    openvdb::MetaMap items = grid;
    for (auto item = grid.beginMeta(); item != grid.endMeta(); ++item)
      if (item->first.starts_with("file_")) items.removeMeta(item->first);
    return items;
  };
  EXPECT_TRUE(withoutStatistics(*back) == withoutStatistics(*source)) << back->str();
  EXPECT_EQ(back->saveFloatAsHalf(), source->saveFloatAsHalf());
}

TEST_P(HoudiniGrid, KeepsItsMap) {
  const auto source = read("in.vdb", GetParam()), back = read("back.vdb", GetParam());
  EXPECT_EQ(back->transform().mapType(), "UniformScaleTranslateMap");
  EXPECT_EQ(back->transform(), source->transform());
}

TEST_P(HoudiniGrid, HasStatisticsOfItsOwnVoxels) {
  const auto source = read("in.vdb", GetParam()), back = read("back.vdb", GetParam());
  const openvdb::MetaMap::Ptr stored = back->getStatsMetadata();
  back->addStatsMetadata();  // computes them again
  EXPECT_TRUE(*stored == *back->getStatsMetadata()) << stored->str();
  EXPECT_EQ(stored->metaCount(), 4u);
  for (const char* corner : {GridBase::META_FILE_BBOX_MIN, GridBase::META_FILE_BBOX_MAX})
    EXPECT_EQ(back->metaValue<openvdb::Vec3i>(corner), source->metaValue<openvdb::Vec3i>(corner));
  EXPECT_EQ(back->metaValue<std::string>(GridBase::META_FILE_COMPRESSION), "blosc + active values");
}

INSTANTIATE_TEST_SUITE_P(Names, HoudiniGrid, testing::Values("density", "vel"),
                         [](const auto& name) { return std::string(name.param); });

TEST_F(HoudiniFile, KeepsItsCreator) {
  openvdb::io::File file(at("back.vdb"));
  file.open(false);
  EXPECT_EQ(file.getMetadata()->metaValue<std::string>("creator"), "Houdini/GEO_VDBTranslator");
}

}  // namespace
}  // namespace esvr
