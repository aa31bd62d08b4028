// Plan: packed grids of every type are written and read by OpenVDB and by readPacked; grids that OpenVDB
// wrote (leaves, tiles, tiles of the root, compressed and not) are read; damaged ones are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "esvr/error.h"
#include "support/temporary_folder.h"
#include "vdb/integer_trees.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::int64_t kLarge = 9007199254740993;  // 2^53 + 1, which is no double

template <class Value>
Value someValue() {
  if constexpr (std::is_same_v<Value, std::int64_t>)
    return kLarge;
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
using Grids = testing::Types<openvdb::Int32Grid, openvdb::Int64Grid, openvdb::BoolGrid>;
TYPED_TEST_SUITE(PackedFile, Grids);

template <class Grid>
void expectSame(const Grid& read, const Grid& source) {
  EXPECT_TRUE(read.tree().hasSameTopology(source.tree()));
  for (auto voxel = source.cbeginValueOn(); voxel; ++voxel)
    EXPECT_EQ(read.tree().getValue(voxel.getCoord()), *voxel);
  EXPECT_EQ(read.background(), source.background());
  EXPECT_EQ(read.transform(), source.transform());
  EXPECT_EQ(read.template metaValue<std::string>("note"), "of labels");
}

TYPED_TEST(PackedFile, IsReadAndWrittenWithAllBits) {
  const auto source = labels<TypeParam>();
  for (const auto compression : {openvdb::io::COMPRESS_NONE, openvdb::io::COMPRESS_ZIP,
                                 openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK}) {
    test::saveCompressed(this->path("in.vdb"), {source}, std::uint32_t(compression));
    const PackedGrid packed = readPacked(this->path("in.vdb"), "labels");
    EXPECT_EQ(valueTypeOf(packed), openvdb::typeNameAsString<typename TypeParam::ValueType>());
    EXPECT_EQ(activeVoxelCount(packed), 2u + kBrickVoxels);
    const std::vector<GridToWrite> grids{&packed};
    writeGrids(this->path("out.vdb"), {}, grids, {.overwrite = true});
    const auto read = openvdb::gridPtrCast<TypeParam>(test::load(this->path("out.vdb"), "labels"));
    ASSERT_TRUE(read);
    expectSame(*read, *source);
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

TEST_F(OtherPackedFile, OfNumbersAndVectorsIsThatOfTheirReaders) {
  auto wind = openvdb::Vec3SGrid::create();
  wind->setName("wind");
  wind->getAccessor().setValue({1, 2, 3}, {1, -2, 3});
  auto calm = openvdb::Vec3SGrid::create();
  calm->setName("calm");
  test::save(path("in.vdb"), {test::smallGrid(), wind, calm});
  const PackedGrid numbers = readPacked(path("in.vdb"), "density");
  EXPECT_EQ(activeVoxelCount(numbers),
            activeVoxelCount(readGrid(path("in.vdb"), "density").volume));
  const PackedGrid vectors = readPacked(path("in.vdb"), "wind");
  const auto& voxels = std::get<PackedVoxels<PackedVector>>(vectors.voxels);
  EXPECT_EQ(voxels.value(0, 0), (PackedVector{1, -2, 3}));
  EXPECT_EQ(activeVoxelCount(readPacked(path("in.vdb"), "calm")), 0u);
  const std::vector<GridToWrite> grids{&numbers, &vectors};
  writeGrids(path("out.vdb"), {}, grids);
  EXPECT_EQ(readGrid(path("out.vdb"), "density").volume.values,
            readGrid(path("in.vdb"), "density").volume.values);
  EXPECT_EQ(valueAt(readVector(path("out.vdb"), "wind").components[1], {1, 2, 3}), -2.0f);
  EXPECT_THAT([&] { writeGrids(path("out.nvdb"), {}, grids); },
              ThrowsMessage<UsageError>(HasSubstr("packed")));
}

TEST_F(OtherPackedFile, OfPointsOrOtherTypesIsRefused) {
  auto texts = openvdb::StringGrid::create("");
  texts->setName("texts");
  texts->getAccessor().setValue({0, 0, 0}, "a");
  openvdb::initialize();
  test::save(path("in.vdb"), {texts});
  EXPECT_THROW((void)readPacked(path("in.vdb"), "texts"), BadInput);
}

}  // namespace
}  // namespace esvr
