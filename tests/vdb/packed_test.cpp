// Plan: packed grids of every type are written and read by OpenVDB and by readPacked; grids that OpenVDB
// wrote (leaves, tiles, tiles of the root, compressed and not) are read; damaged ones are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "support/temporary_folder.h"
#include "vdb/made_files.h"
#include "vdb/trees.h"

namespace esvr {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::int64_t kLarge = 9007199254740993;  // 2^53 + 1, which is no double

template <class Value>
Value someValue() {
  if constexpr (std::is_same_v<Value, std::int64_t>)
    return kLarge;
  else if constexpr (std::is_floating_point_v<Value>)
    return Value(0.1);
  else if constexpr (std::is_same_v<Value, bool>)
    return true;
  else
    return Value(2000000001);
}

/// A leaf with two voxels, a tile of 8^3 and a large tile.
template <class Grid>
typename Grid::Ptr labels() {
  using Value = typename Grid::ValueType;
  openvdb::initialize();
  auto grid = Grid::create(Value(0));
  grid->setName("labels");
  grid->insertMeta("note", openvdb::StringMetadata("of labels"));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  auto accessor = grid->getAccessor();
  accessor.setValue({-1, 2, 3}, someValue<Value>());
  accessor.setValue({-2, 2, 3}, Value(1));
  accessor.addTile(1, {64, 8, 8}, someValue<Value>(), true);
  return grid;
}

template <class Grid>
class PackedFile : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path(const char* name) const { return folder_ / name; }
  test::TemporaryFolder folder_;
};
using PackedTypes = testing::Types<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid,
                                   openvdb::Int64Grid, openvdb::BoolGrid>;
TYPED_TEST_SUITE(PackedFile, PackedTypes);

template <class Grid>
void expectSameVoxels(const Grid& read, const Grid& source) {
  EXPECT_TRUE(read.tree().hasSameTopology(source.tree()));
  for (auto voxel = source.cbeginValueOn(); voxel; ++voxel)
    EXPECT_EQ(read.tree().getValue(voxel.getCoord()), *voxel);
  EXPECT_EQ(read.background(), source.background());
  EXPECT_EQ(read.transform(), source.transform());
  EXPECT_EQ(read.template metaValue<std::string>("note"), "of labels");
}

TYPED_TEST(PackedFile, IsReadAndWrittenWithAllBits) {
  const auto source = labels<TypeParam>();
  using openvdb::io::COMPRESS_ACTIVE_MASK, openvdb::io::COMPRESS_NONE, openvdb::io::COMPRESS_ZIP;
  for (const std::uint32_t compression : std::array<std::uint32_t, 3>{
           COMPRESS_NONE, COMPRESS_ZIP, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK}) {
    test::saveCompressed(this->path("in.vdb"), {source}, compression);
    const PackedGrid packed = readPacked(this->path("in.vdb"), "labels");
    EXPECT_EQ(valueTypeOf(packed), openvdb::typeNameAsString<typename TypeParam::ValueType>());
    EXPECT_EQ(activeVoxelCount(packed), 2u + kBrickVoxels);
    const std::vector<GridToWrite> grids{&packed};
    writeGrids(this->path("out.vdb"), {}, grids, {.overwrite = true});
    const auto read = openvdb::gridPtrCast<TypeParam>(test::load(this->path("out.vdb"), "labels"));
    ASSERT_TRUE(read);
    expectSameVoxels(*read, *source);
  }
}

TYPED_TEST(PackedFile, ThatIsCutShortIsRefused) {
  test::save(this->path("in.vdb"), {labels<TypeParam>()});
  const auto bytes = std::filesystem::file_size(this->path("in.vdb"));
  for (const std::uint64_t left : {bytes - 1, bytes - 60, bytes - 150}) {
    std::filesystem::resize_file(this->path("in.vdb"), left);
    EXPECT_THROW((void)readPacked(this->path("in.vdb"), "labels"), BadInput) << left;
  }
}

TYPED_TEST(PackedFile, WithoutAnActiveVoxelIsReadAndWritten) {
  auto empty = TypeParam::create();
  empty->setName("empty");
  test::save(this->path("in.vdb"), {empty});
  const PackedGrid packed = readPacked(this->path("in.vdb"), "empty");
  EXPECT_EQ(activeVoxelCount(packed), 0u);
  const std::vector<GridToWrite> grids{&packed};
  writeGrids(this->path("out.vdb"), {}, grids);
  EXPECT_TRUE(openvdb::gridPtrCast<TypeParam>(test::load(this->path("out.vdb"), "empty"))->empty());
}

using OtherPackedFile = PackedFile<openvdb::BoolGrid>;

TEST_F(OtherPackedFile, OfAMaskHasItsTrueVoxels) {
  auto mask = labels<openvdb::BoolGrid>();
  mask->getAccessor().setValue({-1, 2, 3}, false);
  test::save(path("in.vdb"), {mask});
  const PackedGrid packed = readPacked(path("in.vdb"), "labels");
  EXPECT_EQ(activeVoxelCount(packed), 1u + kBrickVoxels);
}

TEST_F(OtherPackedFile, OfVectorsHasTheirComponents) {
  openvdb::initialize();
  const auto wind = openvdb::Vec3SGrid::create(openvdb::Vec3s(1, 1, 1));
  wind->setName("wind");
  wind->getAccessor().setValue({1, 2, 3}, {1, -2, 3});
  const auto exact = openvdb::Vec3DGrid::create();
  exact->setName("exact");
  exact->getAccessor().setValue({-1, -2, -3}, {0.1, 0.2, 0.3});
  const auto calm = openvdb::Vec3SGrid::create();
  calm->setName("calm");
  test::save(path("in.vdb"), {wind, exact, calm});
  const PackedGrid vectors = readPacked(path("in.vdb"), "wind");
  const auto& voxels = std::get<PackedVoxels<PackedVector>>(vectors.voxels);
  EXPECT_EQ(voxels.value(0, 0), (PackedVector{1, -2, 3}));
  EXPECT_EQ(voxels.background, (PackedVector{1, 1, 1}));
  const PackedGrid rounded = readPacked(path("in.vdb"), 1);
  EXPECT_EQ(std::get<PackedVoxels<PackedVector>>(rounded.voxels).value(0, 0),
            (PackedVector{0.1f, 0.2f, 0.3f}));
  EXPECT_EQ(activeVoxelCount(readPacked(path("in.vdb"), "calm")), 0u);
  EXPECT_EQ(valueTypeOf(readPacked(path("in.vdb"), "wind.y")), "float");

  const std::vector<GridToWrite> grids{&vectors};
  writeGrids(path("out.vdb"), {}, grids);
  EXPECT_EQ(valueAt(readVector(path("out.vdb"), "wind").components[1], {1, 2, 3}), -2.0f);
  EXPECT_THAT([&] { writeGrids(path("out.nvdb"), {}, grids); },
              ThrowsMessage<UsageError>(HasSubstr("vec3s")));
}

TEST_F(OtherPackedFile, OfFloatsHasTheVoxelsThatReadGridHasAndIsWrittenAsNanoVdb) {
  test::save(path("in.vdb"), {test::smallGrid(2.0f)});
  const PackedGrid numbers = readPacked(path("in.vdb"), "density");
  const std::vector<GridToWrite> grids{&numbers};
  for (const char* name : {"out.vdb", "out.nvdb"}) {
    writeGrids(path(name), {}, grids);
    const VolumeGrid read = readGrid(path(name), "density"), source = readGrid(path("in.vdb"), 0);
    EXPECT_EQ(read.volume.values, source.volume.values) << name;
    EXPECT_EQ(read.volume.active, source.volume.active) << name;
    EXPECT_EQ(read.descriptor.background, 2.0) << name;
  }
  EXPECT_EQ(activeVoxelCount(readPacked(path("out.nvdb"), 0)), activeVoxelCount(numbers));
}

TEST_F(OtherPackedFile, KeepsValuesThatAreNotFinite) {
  const auto grid = test::smallGrid();
  grid->getAccessor().setValue({100, 0, 0}, std::numeric_limits<float>::quiet_NaN());
  test::save(path("in.vdb"), {grid});
  const PackedGrid numbers = readPacked(path("in.vdb"), 0);
  const auto& voxels = std::get<PackedVoxels<float>>(numbers.voxels);
  EXPECT_TRUE(std::isnan(voxels.value(voxels.bricks.size() - 1, 0)));
}

TEST_F(OtherPackedFile, IsRefusedWhereItsTilesNeedTooMuchMemory) {
  const auto grid = openvdb::Int32Grid::create();
  grid->setName("tile");
  grid->getAccessor().addTile(2, {0, 0, 0}, 7, true);  // 128^3 voxels
  test::save(path("in.vdb"), {grid});
  EXPECT_THROW((void)readPacked(path("in.vdb"), 0, {.maxBytes = 1 << 20}), MemoryExceeded);
  EXPECT_EQ(activeVoxelCount(readPacked(path("in.vdb"), 0)), std::uint64_t(128) * 128 * 128);
}

TEST_F(OtherPackedFile, OfACarriedGridIsReadFromItsBytes) {
  test::save(path("in.vdb"), {labels<openvdb::Int64Grid>()});
  const std::vector<std::size_t> places{0};
  const auto carried = readCarried(path("in.vdb"), places);
  const PackedGrid grid = readPacked(carried.at(0));
  EXPECT_EQ(activeVoxelCount(grid), 2u + kBrickVoxels);
  EXPECT_EQ(valueTypeOf(grid), "int64");
}

TEST_F(OtherPackedFile, OfOtherTypesIsRefused) {
  const auto places = openvdb::Vec3IGrid::create();
  places->setName("places");
  places->getAccessor().setValue({0, 0, 0}, {1, 2, 3});
  test::save(path("in.vdb"), {places});
  EXPECT_THAT([&] { (void)readPacked(path("in.vdb"), "places"); },
              ThrowsMessage<BadInput>(HasSubstr("places")));
}

}  // namespace
}  // namespace esvr
