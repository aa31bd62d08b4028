// Plan: both programs process files of the data folder's edge cases whose like no other test makes, with the
// results that their rows in its README state. A file with the metadata that Houdini writes, shows as intrinsics and
// keeps as attributes has the same after a conversion there and back; its statistics are those of the new voxels.

#include "cli/conversion.h"
#include "esvr/quantised.h"
#include "support/machine.h"
#include "vdb/open_vdb.h"

#include <openvdb/io/File.h>

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Fits a real file and decodes it.
class EdgeFile : public Conversion {
 protected:
  void SetUp() override { ESVR_NEEDS_DATA(); }
  [[nodiscard]] static std::string path(const std::string& name) {
    return std::string(ESVR_DATA_DIR) + "/edge/" + name;
  }
  /// Fits a file and converts it back. \return the run of vdb2esvr
  ProgramRun fit(const std::string& name) const {
    auto run = succeeded(quickFit(path(name), out()));
    convertBack();
    return run;
  }
  /// Converts a file there and back. \return the run of vdb2esvr
  ProgramRun throughTheFile(const std::string& name, const Words& options = {}) const {
    auto run = succeeded(vdb2esvr(joined({path(name), out(), "--force"}, options)));
    convertBack();
    return run;
  }
};

TEST_F(EdgeFile, RealFileOfDoublesComesBackAsDoubles) {
  fit("double_grid.vdb");
  EXPECT_EQ(inspectVdb(back()).grids.at(0).valueType, "double");
}

TEST_F(EdgeFile, RealFileOfAMillionVectorsIsSmallestUnchanged) {
  EXPECT_THAT(throughTheFile("vec3_velocity.vdb").out,
              HasSubstr("vel: carried unchanged, because its components would take"));
  EXPECT_EQ(inspectVdb(back()).grids.at(0).activeVoxels, 1'000'000u);
}

TEST_F(EdgeFile, RealFileOfAMillionVectorsIsFittedWhereEllipsoidsAreAskedFor) {
  fit("vec3_velocity.vdb");
  EXPECT_TRUE(inspectVdb(back()).grids.at(0).isVector);
}

/// A file of edge/faults or edge/faults2.
class FaultFile : public EdgeFile {
 protected:
  [[nodiscard]] VolumeGrid read(const std::string& file) const {
    return readGrid(file, inspectVdb(file).grids.at(0).uniqueName);
  }
  [[nodiscard]] VolumeGrid readBack() const { return read(back()); }
};

TEST_F(FaultFile, RealFileOfALevelSetWithAnotherInsideIsKeptByLossless) {
  EXPECT_THAT(throughTheFile("faults/levelset_inside_minus2.vdb", "--lossless").out,
              HasSubstr("2109 inactive values (-2"));
  EXPECT_EQ(readBack().inactive, read(path("faults/levelset_inside_minus2.vdb")).inactive);
}

TEST_F(FaultFile, RealFileOfAGiantTileIsRefusedOrCarried) {
  EXPECT_THAT(vdb2esvr({path("faults/root_tile.vdb"), out(), "--max-memory", "8GB"}),
              Fails(5, "--keep"));
  throughTheFile("faults/root_tile.vdb",
                 {"--keep", inspectVdb(path("faults/root_tile.vdb")).grids.at(0).uniqueName});
}

TEST_F(EdgeFile, RealFileOfPointsIsCarried) {
  EXPECT_THAT(fit("points_only.vdb").err,
              HasSubstr("no grid is fitted; the output has carried grids only"));
  EXPECT_EQ(carriedIn(back()), carriedIn(path("points_only.vdb")));
}

TEST_F(EdgeFile, RealFileWithATypeThatOpenVdbCannotReadGivesAllItsGrids) {
  const auto run = fit("unregistered_type.vdb");
  for (const char* carried : {"flags", "particles"})
    EXPECT_THAT(run.out, HasSubstr(std::string(carried) + ": carried unchanged"));
  EXPECT_THAT(namesIn(back()), ElementsAre("velocity", "phi_obstacle", "phi_inflow", "phi_out",
                                           "flags", "velocity_previous", "particles",
                                           "phi_particles", "phi", "phi_previous"));
}

TEST_F(FaultFile, RealFileOfAnOffsetPressureHasTheQualityOfItsRange) {
  for (const Words& options : {Words{}, {"--representation", "ellipsoids", "--count", "300"}}) {
    throughTheFile("faults/pressure_offset.vdb", options);
    const VolumeGrid a = readGrid(path("faults/pressure_offset.vdb"), "p");
    const VolumeGrid b = readGrid(back(), "p");
    EXPECT_LT(peakOf(a.volume), 41.0);
    const VolumeMetrics m = compareVolumes(a.volume, b.volume);
    EXPECT_GE(m.psnrActive, options.empty() ? 40.0 : 20.0);
    EXPECT_EQ(activeBox(b.volume), activeBox(a.volume));
    EXPECT_GE(activeRange(b.volume).min, a.volume.background - 1.0f);
    EXPECT_EQ(b.volume.background, a.volume.background);
  }
}

TEST_F(FaultFile, RealFileOfARootTileIsComparedByItsBytes) {
  const std::string tile = path("faults/root_tile.vdb");
  succeeded(compare("check", {tile, tile}));
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
  for (const auto& [at, value] : cloud(10))
    accessor.setValue({at.x, at.y + 40, at.z}, unit * value);
  addAttributes(*grid);
  return grid;
}

class HoudiniFile : public FolderTest {
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
    succeeded(vdb2esvr({at("in.vdb"), at("in.esvr"), "--topology", "exact"}));
    ASSERT_TRUE(readEsvr(at("in.esvr")).carried.empty());  // both grids are coded anew
    succeeded(esvr2vdb({at("in.esvr"), at("back.vdb")}));
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
}  // namespace esvr::test
