// Plan: grids of vectors that OpenVDB wrote (floats, doubles, halves, with tiles and a background)
// are read by components, and written so that OpenVDB reads the same vectors. Values that are not
// finite are refused with the component and the voxel. Grids that are not of vectors, are empty or
// are level sets are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "esvr/error.h"
#include "support/temporary_folder.h"
#include "vdb/made_files.h"
#include "vdb/trees.h"

namespace esvr {
namespace {

using openvdb::Vec3DGrid;
using openvdb::Vec3SGrid;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr Coord kVoxel{-1, 2, 3};
constexpr Coord kInTile{64, 8, 9};

/// Vectors with a background, three active voxels and an active tile of 8^3.
template <class Grid>
typename Grid::Ptr windGrid() {
  using Vector = typename Grid::ValueType;
  openvdb::initialize();
  auto grid = Grid::create(Vector(1, 2, -3));
  grid->setName("wind");
  grid->setGridClass(openvdb::GRID_STAGGERED);
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  grid->insertMeta("note", openvdb::StringMetadata("of wind"));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  auto accessor = grid->getAccessor();
  accessor.setValue({-1, 2, 3}, Vector(0.5, -8, 0));
  accessor.setValue({-1, 2, 4}, Vector(0, 0, 0));
  accessor.setValue({7, 0, 0}, Vector(1024, 0.25, -2));
  accessor.addTile(1, {64, 8, 8}, Vector(4, 5, 6), true);
  return grid;
}

template <class Grid>
class VectorFile : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path(const char* name) const { return folder_ / name; }
  test::TemporaryFolder folder_;
};
using VectorGrids = testing::Types<Vec3SGrid, Vec3DGrid>;
TYPED_TEST_SUITE(VectorFile, VectorGrids);

TYPED_TEST(VectorFile, IsReadByComponents) {
  test::save(this->path("in.vdb"), {windGrid<TypeParam>()});
  const GridSummary summary = inspectVdb(this->path("in.vdb")).grids.front();
  EXPECT_TRUE(summary.isVector);
  EXPECT_FALSE(summary.isScalar);
  const VectorGrid wind = readVector(this->path("in.vdb"), "wind");
  EXPECT_THAT(wind.background, ElementsAre(1.0, 2.0, -3.0));
  const auto& [x, y, z] = wind.components;
  EXPECT_EQ(valueAt(x, kVoxel), 0.5f);
  EXPECT_EQ(valueAt(y, kVoxel), -8.0f);
  EXPECT_EQ(valueAt(z, kInTile), 6.0f);
  EXPECT_EQ(activeVoxelCount(x), 3u + kBrickVoxels);
  const VolumeGrid alone = readComponent(this->path("in.vdb"), "wind", 1);
  EXPECT_EQ(alone.descriptor.name, "wind.y");
  EXPECT_EQ(alone.volume.values, y.values);
  EXPECT_TRUE(alone.descriptor.metadata.empty());
}

TYPED_TEST(VectorFile, IsWrittenAsItWasRead) {
  for (const bool half : {false, true}) {
    const auto source = windGrid<TypeParam>();
    source->setSaveFloatAsHalf(half);
    test::save(this->path("in.vdb"), {source});
    const VectorGrid wind = readVector(this->path("in.vdb"), "wind");
    const std::vector<GridToWrite> grids{&wind};
    writeGrids(this->path("out.vdb"), {}, grids, {.overwrite = true});
    const auto read = openvdb::gridPtrCast<TypeParam>(test::load(this->path("out.vdb"), "wind"));
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->tree().hasSameTopology(source->tree()));
    for (auto voxel = source->cbeginValueOn(); voxel; ++voxel)
      EXPECT_EQ(read->tree().getValue(voxel.getCoord()), *voxel);
    EXPECT_EQ(read->background(), source->background());
    EXPECT_EQ(read->transform(), source->transform());
    EXPECT_EQ(read->getGridClass(), openvdb::GRID_STAGGERED);
    EXPECT_EQ(read->getVectorType(), openvdb::VEC_CONTRAVARIANT_RELATIVE);
    EXPECT_EQ(read->template metaValue<std::string>("note"), "of wind");
    EXPECT_EQ(read->saveFloatAsHalf(), half);
  }
}

TYPED_TEST(VectorFile, WithANumberThatIsNotFiniteNamesComponentAndVoxel) {
  const auto grid = windGrid<TypeParam>();
  auto accessor = grid->getAccessor();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  accessor.setValue({5, 6, 7}, typename TypeParam::ValueType(0.0, nan, 0.0));
  test::save(this->path("in.vdb"), {grid});
  EXPECT_EQ(readComponent(this->path("in.vdb"), "wind", 0).nonFiniteReplaced, 0u);
  EXPECT_THAT([&] { (void)readVector(this->path("in.vdb"), "wind"); },
              ThrowsMessage<BadInput>(
                  AllOf(HasSubstr("\"wind.y\""), HasSubstr("the first is at (5, 6, 7)"))));
  const VectorGrid wind =
      readVector(this->path("in.vdb"), "wind", {.nonFinite = NonFinite::kValue});
  EXPECT_EQ(wind.nonFiniteReplaced, 1u);
  EXPECT_EQ(valueAt(wind.components[1], {5, 6, 7}), 0.0f);
}

TYPED_TEST(VectorFile, IsReadFromItsCarriedBytes) {
  test::save(this->path("in.vdb"), {windGrid<TypeParam>()});
  const std::vector<std::size_t> places{0};
  const CarriedGrid carried = readCarried(this->path("in.vdb"), places).front();
  EXPECT_EQ(readVector(carried).components[2].values,
            readVector(this->path("in.vdb"), "wind").components[2].values);
}

using OtherVectors = VectorFile<Vec3SGrid>;

TEST_F(OtherVectors, ThatAreEmptyOrALevelSetAreNotRead) {
  const auto level = windGrid<Vec3SGrid>();
  level->setName("level");
  level->setGridClass(openvdb::GRID_LEVEL_SET);
  const auto empty = Vec3SGrid::create();
  empty->setName("empty");
  test::save(path("in.vdb"), {level, empty, test::smallGrid()});
  const auto refused = [&](const char* name, const char* why) {
    EXPECT_THAT([&] { (void)readComponent(path("in.vdb"), name, 0); },
                ThrowsMessage<BadInput>(AllOf(HasSubstr(name), HasSubstr(why))));
  };
  refused("level", "a level set of vectors");
  refused("empty", "no active voxel");
  refused("density", "numbers, not vectors");
  EXPECT_THAT([&] { (void)readGrid(path("in.vdb"), "level"); },
              ThrowsMessage<BadInput>(HasSubstr("level set of vectors")));
}

TEST_F(OtherVectors, AreCountedWithoutStatistics) {
  test::saveCompressed(path("in.vdb"), {windGrid<Vec3SGrid>()}, openvdb::io::COMPRESS_NONE);
  openvdb::io::File file(path("plain.vdb").string());
  file.setGridStatsMetadataEnabled(false);
  file.write(openvdb::GridPtrVec{windGrid<Vec3SGrid>()});
  for (const char* name : {"in.vdb", "plain.vdb"})
    EXPECT_EQ(inspectVdb(path(name)).grids.front().activeVoxels, 3u + kBrickVoxels);
}

TEST_F(OtherVectors, BeyondHalfAreNotWrittenAsHalf) {
  test::save(path("in.vdb"), {windGrid<Vec3SGrid>()});
  VectorGrid wind = readVector(path("in.vdb"), "wind");
  wind.components[2].brickValues(0)[voxelOffset(localOf(kVoxel))] = 1e6f;
  const std::vector<GridToWrite> grids{&wind};
  EXPECT_THAT([&] { writeGrids(path("out.vdb"), {}, grids, {.half = HalfMode::kOn}); },
              ThrowsMessage<UsageError>(HasSubstr("65504")));
}

TEST_F(OtherVectors, AreNotWrittenToNanoVdb) {
  test::save(path("in.vdb"), {windGrid<Vec3SGrid>()});
  const VectorGrid wind = readVector(path("in.vdb"), "wind");
  const std::vector<GridToWrite> grids{&wind};
  EXPECT_THAT([&] { writeGrids(path("out.nvdb"), {}, grids); },
              ThrowsMessage<UsageError>(AllOf(HasSubstr("wind"), HasSubstr("vectors"))));
}

TEST_F(OtherVectors, OfMoreMemoryThanAllowedAreRefused) {
  test::save(path("in.vdb"), {windGrid<Vec3SGrid>()});
  constexpr std::uint64_t kTwoComponents = 20'000;  // three bricks take 6 KB in each
  EXPECT_NO_THROW((void)readComponent(path("in.vdb"), "wind", 0, {.maxBytes = kTwoComponents}));
  EXPECT_THROW((void)readVector(path("in.vdb"), "wind", {.maxBytes = kTwoComponents / 2}),
               MemoryExceeded);
}

}  // namespace
}  // namespace esvr
