// Plan: a file has the metadata that Houdini writes: the items that it shows as intrinsics of a
// primitive (class, creator, is_local_space, is_saved_as_half_float, value_type, vector_type), the
// name, primitive attributes of several types, and the statistics file_*. After a conversion there
// and back, OpenVDB reads the same items and the same transform. The statistics are those of the new
// voxels.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/File.h>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "vdb/trees.h"

namespace esvr {
namespace {

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
