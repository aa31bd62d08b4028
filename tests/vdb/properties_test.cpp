// Plan: an item of every type that OpenVDB registers, and one of an unknown type, is stored in the file and
// in a grid. The bytes that are read equal those that OpenVDB wrote, and OpenVDB reads equal items from the
// written file. Statistics and temporary items are not copied, and some are not overwritten.
//
// A grid is stored with every map that OpenVDB has. The bytes of the map are read unchanged. OpenVDB reads
// the same map of the same type from the written file. The affine matrix agrees with OpenVDB's indexToWorld
// in float64, up to rounding.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/math/Maps.h>

#include <limits>
#include <sstream>

#include "esvr/error.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

using openvdb::Vec3d;
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

namespace math = openvdb::math;

struct NamedMap {
  const char* name;
  math::MapBase::Ptr map;
};
std::ostream& operator<<(std::ostream& out, const NamedMap& map) { return out << map.name; }

math::Mat4d sheared() {
  math::Mat4d m(math::rotation<math::Mat4d>(Vec3d(1, 2, 3).unit(), 0.7));
  m.postScale(Vec3d(0.3, 2.0, 1e-3));
  m.postShear(math::X_AXIS, math::Y_AXIS, 0.4);
  m.postTranslate(Vec3d(1e6, -3.25, 0.1));
  return m;
}

template <class Map, class... Args>
NamedMap make(Args&&... args) {
  openvdb::initialize();
  static const std::string name = Map::mapType();
  return {name.c_str(), std::make_shared<Map>(std::forward<Args>(args)...)};
}

std::vector<NamedMap> everyMap() {
  const openvdb::BBoxd box(Vec3d(0), Vec3d(100, 80, 60));
  return {
      make<math::ScaleMap>(Vec3d(0.1, -2.0, 3.0)), make<math::UniformScaleMap>(0.1),
      make<math::TranslationMap>(Vec3d(0.1, 0.2, 0.3)),
      make<math::ScaleTranslateMap>(Vec3d(0.1, 0.2, 0.3), Vec3d(4, 5, 6)),
      make<math::UniformScaleTranslateMap>(1.0 / 3.0, Vec3d(4, 5, 6)),
      make<math::UnitaryMap>(Vec3d(1, 1, 0).unit(), 0.3), make<math::AffineMap>(sheared()),
      // OpenVDB could simplify this map. It must keep its type.
      make<math::AffineMap>(math::Mat4d::identity()),
      make<math::NonlinearFrustumMap>(box, 0.4, 2.5),
      make<math::NonlinearFrustumMap>(box, 0.4, 2.5, std::make_shared<math::AffineMap>(sheared()))};
}

/// A grid with exactly this map, which the constructor of Transform would simplify.
openvdb::FloatGrid::Ptr gridUnder(const math::MapBase& map) {
  std::stringstream stream(std::ios::in | std::ios::out | std::ios::binary);
  openvdb::io::setCurrentVersion(stream);
  openvdb::writeString(stream, map.type());
  map.write(stream);
  auto grid = test::smallGrid();
  grid->transform().read(stream);
  return grid;
}

class EveryMap : public testing::TestWithParam<NamedMap> {
 protected:
  test::TemporaryFolder directory_;
};

TEST_P(EveryMap, ComesBackFromVdbVerbatim) {
  const math::MapBase& map = *GetParam().map;
  test::save(directory_ / "in.vdb", {gridUnder(map)});
  const auto grid = readGrid(directory_ / "in.vdb", "density");
  EXPECT_EQ(grid.descriptor.transform.mapType, map.type());

  writeGrids(directory_ / "out.vdb", {}, {&grid, 1});
  const auto back = test::load(directory_ / "out.vdb", "density");
  EXPECT_EQ(back->transform().mapType(), map.type());
  EXPECT_TRUE(back->transform().baseMap()->isEqual(map));
  EXPECT_EQ(readGrid(directory_ / "out.vdb", "density").descriptor, grid.descriptor);
}

TEST_P(EveryMap, HasItsAffineMatrixWhereItIsLinear) {
  const math::MapBase& map = *GetParam().map;
  test::save(directory_ / "in.vdb", {gridUnder(map)});
  const auto affine = readGrid(directory_ / "in.vdb", "density").descriptor.transform.affine;
  ASSERT_EQ(affine.has_value(), map.isLinear());
  if (!affine) return;
  const Vec3d voxel(3, -5, 1000);
  const Vec3d world = map.applyMap(voxel);
  for (int c = 0; c < 3; ++c) {
    double sum = (*affine)[std::size_t(12 + c)], size = std::abs(sum);
    for (int r = 0; r < 3; ++r) {
      const double term = voxel[r] * (*affine)[std::size_t(4 * r + c)];
      sum += term;
      size += std::abs(term);
    }
    // Both sides have four terms, each of which is rounded once and added once.
    EXPECT_NEAR(sum, world[c], 16 * std::numeric_limits<double>::epsilon() * size);
  }
}

TEST_P(EveryMap, ComesBackFromNvdbAsTheSameAffineMatrix) {
  const math::MapBase& map = *GetParam().map;
  test::save(directory_ / "in.vdb", {gridUnder(map)});
  const auto grid = readGrid(directory_ / "in.vdb", "density");
  if (!map.isLinear()) {
    EXPECT_THROW(writeGrids(directory_ / "out.nvdb", {}, {&grid, 1}), UsageError);
    return;
  }
  writeGrids(directory_ / "out.nvdb", {}, {&grid, 1});
  EXPECT_EQ(readGrid(directory_ / "out.nvdb", "density").descriptor.transform.affine,
            grid.descriptor.transform.affine);
}

INSTANTIATE_TEST_SUITE_P(OpenVdb, EveryMap, testing::ValuesIn(everyMap()));

TEST(UniformTransform, IsWhatOpenVdbMakes) {
  const auto transform = uniformTransform(0.1);
  EXPECT_EQ(transform.mapType, "UniformScaleMap");
  auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  grid.descriptor.transform = transform;
  const test::TemporaryFolder directory;
  writeGrids(directory / "out.vdb", {}, {&grid, 1});
  EXPECT_TRUE(test::load(directory / "out.vdb", "density")->transform() ==
              *math::Transform::createLinearTransform(0.1));
}

TEST(UniformTransform, RefusesInvalidSizes) {
  for (const double size : {0.0, -1.0, std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW((void)uniformTransform(size), UsageError) << size;
}

TEST(AffineTransform, KeepsTheMatrix) {
  std::array<double, 16> matrix;
  std::copy_n(sheared().asPointer(), 16, matrix.begin());
  const auto transform = affineTransform(matrix);
  EXPECT_EQ(transform.mapType, "AffineMap");
  EXPECT_EQ(transform.affine, matrix);
}

TEST(AffineTransform, RefusesMatricesThatAreNotAffineOrSingular) {
  std::array<double, 16> singular{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  EXPECT_THROW((void)affineTransform(singular), UsageError);
  std::array<double, 16> projective{1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_THROW((void)affineTransform(projective), UsageError);
  std::array<double, 16> nan{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  nan[5] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)affineTransform(nan), UsageError);
}

}  // namespace
}  // namespace esvr
