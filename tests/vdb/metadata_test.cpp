/// Plan: an item of every type that OpenVDB registers, and one of an unknown type, is stored in the
/// file and in a grid. The bytes that are read equal those that OpenVDB wrote, and OpenVDB reads
/// equal items from the written file. Statistics and temporary items are not copied, and some are
/// not overwritten.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"
#include "vdb/expect_same.h"
#include "vdb/made_files.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

using test::TemporaryFolder;
using testing::Contains;
using testing::Field;
using testing::Not;

/// Inserts one item of each type.
void insertEveryType(openvdb::MetaMap& map) {
  openvdb::initialize();
  map.insertMeta("a bool", openvdb::BoolMetadata(true));
  map.insertMeta("a double", openvdb::DoubleMetadata(0.1));
  map.insertMeta("a float", openvdb::FloatMetadata(-0.0f));
  map.insertMeta("an int32", openvdb::Int32Metadata(-7));
  map.insertMeta("an int64", openvdb::Int64Metadata(std::int64_t{1} << 40));
  map.insertMeta("a string", openvdb::StringMetadata(std::string("zero\0inside, \xff", 15)));
  map.insertMeta("an empty string", openvdb::StringMetadata(""));
  map.insertMeta("a vec2d", openvdb::Vec2DMetadata({1, 2}));
  map.insertMeta("a vec2i", openvdb::Vec2IMetadata({1, 2}));
  map.insertMeta("a vec2s", openvdb::Vec2SMetadata({1, 2}));
  map.insertMeta("a vec3d", openvdb::Vec3DMetadata({1, 2, 3}));
  map.insertMeta("a vec3i", openvdb::Vec3IMetadata({1, 2, 3}));
  map.insertMeta("a vec3s", openvdb::Vec3SMetadata({1, 2, 3}));
  map.insertMeta("a vec4d", openvdb::Vec4DMetadata({1, 2, 3, 4}));
  map.insertMeta("a vec4i", openvdb::Vec4IMetadata({1, 2, 3, 4}));
  map.insertMeta("a vec4s", openvdb::Vec4SMetadata({1, 2, 3, 4}));
  map.insertMeta("a mat4s", openvdb::Mat4SMetadata(openvdb::Mat4s::identity()));
  map.insertMeta("a mat4d", openvdb::Mat4DMetadata(openvdb::Mat4d::identity()));
  openvdb::UnknownMetadata unknown("a type of tomorrow");
  unknown.setValue({1, 2, 3, 0, 255});
  map.insertMeta("an unknown", unknown);
  map.insertMeta("file_of_mine", openvdb::StringMetadata("not a statistic"));
}

std::string described(const openvdb::MetaMap& map) { return map.str(); }

TEST(Metadata, EveryTypeComesBackVerbatim) {
  const TemporaryFolder directory;
  openvdb::MetaMap fileMetadata;
  insertEveryType(fileMetadata);
  auto source = test::smallGrid();
  insertEveryType(*source);
  test::save(directory / "in.vdb", {source}, fileMetadata);

  const auto items = inspectVdb(directory / "in.vdb").metadata;
  EXPECT_EQ(items.size(), fileMetadata.metaCount());
  const auto grid = readGrid(directory / "in.vdb", "density");
  EXPECT_EQ(grid.descriptor.metadata.size(), source->metaCount());

  writeGrids(directory / "out.vdb", items, {&grid, 1});
  test::expectSame(readGrid(directory / "out.vdb", "density"), grid);
  const auto back = test::load(directory / "out.vdb", "density");
  for (auto it = source->beginMeta(); it != source->endMeta(); ++it) {
    ASSERT_TRUE((*back)[it->first]) << it->first;
    EXPECT_EQ((*back)[it->first]->typeName(), it->second->typeName()) << it->first;
    EXPECT_TRUE(*(*back)[it->first] == *it->second) << it->first;
  }
  openvdb::io::File file((directory / "out.vdb").string());
  file.open(false);
  auto backFile = file.getMetadata();
  EXPECT_EQ(backFile->getMetadata<openvdb::StringMetadata>("esvr_writer")->value().substr(0, 4),
            "esvr");
  backFile->removeMeta("esvr_writer");
  EXPECT_TRUE(*backFile == fileMetadata) << described(*backFile);
}

TEST(Metadata, BytesAreThoseOfTheValueWithoutItsSize) {
  const TemporaryFolder directory;
  auto source = test::smallGrid();
  source->insertMeta("answer", openvdb::Int32Metadata(0x01020304));
  test::save(directory / "in.vdb", {source});
  const std::vector<std::byte> littleEndian{std::byte{4}, std::byte{3}, std::byte{2}, std::byte{1}};
  EXPECT_THAT(readGrid(directory / "in.vdb", "density").descriptor.metadata,
              Contains(MetaItem{"answer", "int32", littleEndian}));
}

TEST(Metadata, StatisticsOfTheOldFileAreReplacedByThoseOfTheNew) {
  const TemporaryFolder directory;
  test::save(directory / "in.vdb", {test::smallGrid()});
  auto grid = readGrid(directory / "in.vdb", "density");
  for (const char* name : {"file_bbox_min", "file_bbox_max", "file_compression", "file_mem_bytes",
                           "file_voxel_count", "file_delayed_load"})
    EXPECT_THAT(grid.descriptor.metadata, Not(Contains(Field(&MetaItem::name, name))));

  grid.volume = test::volumeOf({{{100, 100, 100}, 1.0f}});
  writeGrids(directory / "out.vdb", {}, {&grid, 1});
  const auto summary = inspectVdb(directory / "out.vdb").grids.front();
  EXPECT_EQ(summary.activeVoxels, 1u);
  EXPECT_EQ(summary.activeBox, (Box{{100, 100, 100}, {100, 100, 100}}));
}

TEST(Metadata, AnItemUnderOurOwnKeyIsNotOverwritten) {
  const TemporaryFolder directory;
  const auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  const std::vector<MetaItem> items{stringItem("creator", "Houdini 20.5"),
                                    stringItem("esvr_writer", "someone else")};
  writeGrids(directory / "out.vdb", items, {&grid, 1});
  EXPECT_EQ(inspectVdb(directory / "out.vdb").metadata, items);
}

TEST(Metadata, VectorTypeAndLocalSpaceReachTheHost) {
  const TemporaryFolder directory;
  auto source = test::smallGrid();
  source->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  source->setIsInWorldSpace(false);
  source->setCreator("a creator of the grid's own");
  test::save(directory / "in.vdb", {source});
  const auto grid = readGrid(directory / "in.vdb", "density");
  writeGrids(directory / "out.vdb", {}, {&grid, 1});
  const auto back = test::load(directory / "out.vdb", "density");
  EXPECT_EQ(back->getVectorType(), openvdb::VEC_CONTRAVARIANT_RELATIVE);
  EXPECT_FALSE(back->isInWorldSpace());
  EXPECT_EQ(back->getCreator(), "a creator of the grid's own");
}

TEST(Metadata, ADescriptorFromScratchNeedsNone) {
  const TemporaryFolder directory;
  auto grid = test::gridOf("temperature", {{{0, 0, 0}, 1.0f}});
  grid.descriptor.gridClass = GridClass::kStaggered;
  writeGrids(directory / "out.vdb", {}, {&grid, 1});
  const auto back = test::load(directory / "out.vdb", "temperature");
  EXPECT_EQ(back->getName(), "temperature");
  EXPECT_EQ(back->getGridClass(), openvdb::GRID_STAGGERED);
}

TEST(Metadata, AnItemWhoseBytesDoNotFitItsTypeIsCarriedAsTheyAre) {
  const TemporaryFolder directory;
  auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  const MetaItem odd{"odd", "vec3s", {std::byte{1}, std::byte{2}}};
  grid.descriptor.metadata.push_back(odd);
  writeGrids(directory / "out.vdb", {}, {&grid, 1});
  EXPECT_THAT(readGrid(directory / "out.vdb", "density").descriptor.metadata, Contains(odd));
}

}  // namespace
}  // namespace esvr
