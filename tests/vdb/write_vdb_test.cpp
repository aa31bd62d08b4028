// Plan: OpenVDB's own reader reads the written files, at once and later when voxels are needed: values,
// states, tiles, types, half floats and statistics. Writing can fail in several ways, each of which leaves no
// file.
//
// Packed grids of every type are written and read by OpenVDB and by readPacked; grids that OpenVDB wrote
// (leaves, tiles, tiles of the root, compressed and not) are read; damaged ones are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "support/files.h"
#include "support/messages.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

using openvdb::FloatGrid;

std::vector<test::Voxel> fullBrick(Coord corner, float value) {
  std::vector<test::Voxel> voxels;
  for (int i = 0; i < kBrickVoxels; ++i) voxels.push_back({corner + voxelLocal(i), value});
  return voxels;
}

class Write : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return directory_ / "out.vdb"; }
  void write(const VolumeGrid& grid, const WriteOptions& options = {},
             const std::string& name = "out.vdb") const {
    writeGrids(directory_ / name, {}, {&grid, 1}, options);
  }
  FloatGrid::Ptr writeAndLoad(const VolumeGrid& grid, const WriteOptions& options = {}) {
    write(grid, options);
    return openvdb::gridPtrCast<FloatGrid>(test::load(path(), grid.descriptor.name));
  }
  test::TemporaryFolder directory_;
  const VolumeGrid grid_ = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
};

TEST_F(Write, InactiveVoxelsHoldTheBackground) {
  auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}, {{-3, 5, 100}, 2.0f}}, 0.5f);
  grid.volume.values[1] = 99.0f;  // an inactive voxel may hold any value
  const auto back = writeAndLoad(grid);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->background(), 0.5f);
  EXPECT_EQ(back->activeVoxelCount(), 2u);
  EXPECT_EQ(back->tree().getValue({0, 0, 0}), 1.0f);
  EXPECT_EQ(back->tree().getValue({0, 0, 1}), 0.5f);
  EXPECT_EQ(back->tree().getValue({-3, 5, 100}), 2.0f);
}

// Nodes of the tree take 0.3 MB for each of these voxels.
TEST_F(Write, VoxelsFarFromEachOtherKeepToTheMemory) {
  std::vector<test::Voxel> voxels;
  for (int i = 0; i < 30; ++i) voxels.push_back({{5000 * i, -7000 * i, 0}, 1.0f});
  const VolumeGrid far = test::gridOf("far", voxels);
  VectorGrid vectors;
  vectors.descriptor.name = "vectors";
  for (SparseVolume& component : vectors.components) component = far.volume;
  WriteOptions options{.overwrite = true, .maxBytes = 5'000'000};
  for (const GridToWrite grid : {GridToWrite(&far), GridToWrite(&vectors)})
    EXPECT_THAT(
        [&] { writeGrids(path(), {}, std::span(&grid, 1), options); },
        test::ThrowsSaying<MemoryExceeded>("the tree of OpenVDB for grid \"", "5 MB are allowed"));
  options.maxBytes = 50'000'000;
  writeGrids(path(), {}, std::span(&far, 1), options);
  EXPECT_EQ(inspectVdb(path()).grids.at(0).activeVoxels, 30u);
}

TEST_F(Write, ConstantLeavesBecomeTilesUnlessToldOtherwise) {
  auto voxels = fullBrick({8, 16, -8}, 0.75f);
  voxels.push_back({{0, 0, 0}, 2.0f});
  const auto grid = test::gridOf("density", voxels);
  const auto tiled = writeAndLoad(grid);
  EXPECT_EQ(tiled->tree().leafCount(), 1u);
  EXPECT_EQ(tiled->activeVoxelCount(), 513u);
  EXPECT_EQ(tiled->tree().getValue({15, 23, -1}), 0.75f);
  EXPECT_EQ(test::volumeDifference(readGrid(path(), "density").volume, grid.volume), "");
  const auto leaves = writeAndLoad(grid, {.overwrite = true, .constantTiles = false});
  EXPECT_EQ(leaves->tree().leafCount(), 2u);
}

/// The prune() of OpenVDB takes a NaN to be equal to any number (findings/openvdb-nan-equals-any-number.sh).
TEST_F(Write, ANanDoesNotMakeABrickConstant) {
  std::vector<test::Voxel> voxels = fullBrick({0, 0, 0}, 5.0f);
  voxels[292].value = kNan;
  for (int i = 0; i < kBrickVoxels; ++i)
    voxels.push_back({Coord{8, 0, 0} + voxelLocal(i), i > 0 ? float(i) : kNan});
  const auto equal = fullBrick({16, 0, 0}, 0.75f), none = fullBrick({24, 0, 0}, kNan);
  voxels.insert(voxels.end(), equal.begin(), equal.end());
  voxels.insert(voxels.end(), none.begin(), none.end());
  for (const GridClass gridClass : {GridClass::kFogVolume, GridClass::kLevelSet})
    for (const char* name : {"out.vdb", "out.nvdb"}) {
      SCOPED_TRACE(name);
      auto grid = test::gridOf("density", voxels, 1000.0f);
      grid.descriptor.gridClass = gridClass;
      write(grid, {.overwrite = true}, name);
      const auto back =
          readGrid(directory_ / name, "density", {.nonFinite = NonFinite::kKeep}).volume;
      EXPECT_EQ(test::volumeDifference(back, grid.volume), "");
    }
}

// Blender draws nothing of a grid without a leaf.
TEST_F(Write, LeavesRemainWhereAllVoxelsWouldBeInTiles) {
  auto voxels = fullBrick({8, 16, -8}, 0.75f);
  const auto more = fullBrick({16, 16, -8}, 0.75f);
  voxels.insert(voxels.end(), more.begin(), more.end());
  for (const GridClass gridClass : {GridClass::kFogVolume, GridClass::kLevelSet}) {
    auto grid = test::gridOf("density", voxels);
    grid.descriptor.gridClass = gridClass;
    const auto back = writeAndLoad(grid, {.overwrite = true});
    EXPECT_EQ(back->tree().leafCount(), 2u);
    EXPECT_EQ(back->activeVoxelCount(), 1024u);
    EXPECT_EQ(test::volumeDifference(readGrid(path(), "density").volume, grid.volume), "");
  }
}

TEST_F(Write, AMergedTileOfManyBricksKeepsALeafToo) {
  std::vector<test::Voxel> voxels;
  for (int brick = 0; brick < 4096; ++brick) {
    const Coord corner = Coord{brick / 256, brick / 16 % 16, brick % 16} * kBrickSide;
    const auto more = fullBrick(corner, 0.5f);
    voxels.insert(voxels.end(), more.begin(), more.end());
  }
  const auto back = writeAndLoad(test::gridOf("density", voxels));
  EXPECT_EQ(back->tree().leafCount(), 1u);
  EXPECT_EQ(back->activeVoxelCount(), 128u * 128u * 128u);
}

TEST_F(Write, DoublesThatWereSavedAsHalfAreRoundedOnlyIfNothingIsLost) {
  for (const float value : {0.25f, 0.1f}) {
    auto source = openvdb::DoubleGrid::create();
    source->setName("density");
    source->tree().setValue({1, 2, 3}, 0.25);
    source->setSaveFloatAsHalf(true);
    test::save(path(), {source});
    VolumeGrid grid = readGrid(path(), "density");
    grid.volume.brickValues(0)[voxelOffset({1, 2, 3})] = value;
    write(grid, {.overwrite = true});
    EXPECT_EQ(inspectVdb(path()).grids.front().savedAsHalf, value == 0.25f);
    EXPECT_EQ(valueAt(readGrid(path(), "density").volume, {1, 2, 3}), value);
  }
}

TEST_F(Write, LeavesWithoutActiveVoxelsAreNotWritten) {
  auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}, {{100, 0, 0}, 1.0f}});
  grid.volume.active.back() = {};
  EXPECT_EQ(writeAndLoad(grid)->tree().leafCount(), 1u);
}

TEST_F(Write, ALevelSetComesBackWithSignsEverywhere) {
  openvdb::initialize();
  auto sphere = openvdb::tools::createLevelSetSphere<FloatGrid>(40.0f, {0, 0, 0}, 1.0f, 3.0f);
  sphere->setName("surface");
  test::save(directory_ / "in.vdb", {sphere});
  const auto back = writeAndLoad(readGrid(directory_ / "in.vdb", "surface"));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_TRUE(back->tree().hasSameTopology(sphere->tree()));
  for (int x = -48; x < 48; x += 2)  // leaves, the space inside and outside, and tiles
    for (int y = -48; y < 48; y += 2)
      for (int z = -48; z < 48; ++z)
        ASSERT_EQ(back->tree().getValue({x, y, z}), sphere->tree().getValue({x, y, z}));
}

TEST_F(Write, ActiveVoxelsOfALevelSetSurviveTheFloodFill) {
  // Fluid solvers write such files: all voxels are active, and whole leaves have one value.
  auto voxels = fullBrick({0, 0, 0}, -1.25f);
  for (const auto& voxel : fullBrick({8, 0, 0}, 7.0f)) voxels.push_back(voxel);
  auto grid = test::gridOf("phi", voxels, 3.0f);
  grid.descriptor.gridClass = GridClass::kLevelSet;
  const auto back = writeAndLoad(grid);
  EXPECT_EQ(back->activeVoxelCount(), 1024u);
  EXPECT_EQ(back->tree().getValue({3, 3, 3}), -1.25f);
  EXPECT_EQ(back->tree().getValue({11, 3, 3}), 7.0f);
}

TEST_F(Write, ALevelSetWithBackgroundZeroIsWrittenWithoutFloodFill) {
  auto grid = test::gridOf("phi", {{{0, 0, 0}, -1.0f}, {{1, 0, 0}, 1.0f}});
  grid.descriptor.gridClass = GridClass::kLevelSet;
  EXPECT_EQ(writeAndLoad(grid)->tree().getValue({0, 0, 1}), 0.0f);
}

TEST_F(Write, ADoubleSourceComesBackDouble) {
  auto grid = test::gridOf("density", {{{0, 0, 0}, 0.1f}});
  grid.descriptor.valueType = ValueType::kDouble;
  grid.descriptor.background = 0.1;
  grid.volume.background = 0.1f;
  write(grid);
  const auto back = openvdb::gridPtrCast<openvdb::DoubleGrid>(test::load(path(), "density"));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->background(), 0.1);
  EXPECT_EQ(back->tree().getValue({0, 0, 0}), double(0.1f));
}

TEST_F(Write, HalfFollowsTheSourceUnlessToldOtherwise) {
  auto grid = test::gridOf("density", {{{0, 0, 0}, 0.1f}});
  const auto savedAsHalf = [&](ValueType source, HalfMode mode) {
    grid.descriptor.valueType = source;
    const auto back = writeAndLoad(grid, {.half = mode, .overwrite = true});
    const float expected = back->saveFloatAsHalf() ? float(openvdb::math::half(0.1f)) : 0.1f;
    EXPECT_EQ(back->tree().getValue({0, 0, 0}), expected);
    EXPECT_EQ(back->type(), "Tree_float_5_4_3");  // never the native half grid of OpenVDB
    return inspectVdb(path()).grids.front().savedAsHalf;
  };
  EXPECT_FALSE(savedAsHalf(ValueType::kFloat, HalfMode::kAuto));
  EXPECT_TRUE(savedAsHalf(ValueType::kHalf, HalfMode::kAuto));
  EXPECT_TRUE(savedAsHalf(ValueType::kFloat, HalfMode::kOn));
  EXPECT_FALSE(savedAsHalf(ValueType::kHalf, HalfMode::kOff));
}

TEST_F(Write, ValuesBeyondHalfAreRefusedNotMadeInfinite) {
  auto grid = test::gridOf("density", {{{0, 0, 0}, 65504.0f}});
  EXPECT_NO_THROW(write(grid, {.half = HalfMode::kOn}));
  grid = test::gridOf("heat", {{{0, 0, 0}, -70000.0f}});
  EXPECT_THAT([&] { write(grid, {.half = HalfMode::kOn, .overwrite = true}); },
              test::ThrowsSaying<UsageError>("heat", "65504"));
  EXPECT_EQ(inspectVdb(path()).grids.front().name, "density");  // the old file stands
  EXPECT_EQ(directory_.names().size(), 1u);
}

TEST_F(Write, SeveralGridsOfOneNameKeepTheirOrder) {
  const std::vector<VolumeGrid> grids{test::gridOf("a", {{{0, 0, 0}, 1.0f}}),
                                      test::gridOf("a", {{{0, 0, 0}, 2.0f}}),
                                      test::gridOf("", {{{0, 0, 0}, 3.0f}})};
  writeGrids(path(), {}, grids);
  EXPECT_EQ(valueAt(readGrid(path(), "a[1]").volume, {0, 0, 0}), 2.0f);
  EXPECT_EQ(valueAt(readGrid(path(), "").volume, {0, 0, 0}), 3.0f);
}

TEST_F(Write, IsPackedByBloscAndActiveMask) {
  const auto back = writeAndLoad(grid_);
  const auto packing =
      back->getMetadata<openvdb::StringMetadata>(openvdb::GridBase::META_FILE_COMPRESSION);
  ASSERT_TRUE(packing);
  EXPECT_EQ(packing->value(), "blosc + active values");
}

/// Voxels in many leaves whose compressed bytes differ.
std::vector<test::Voxel> leavesOfManySizes() {
  std::vector<test::Voxel> voxels;
  for (int leaf = 0; leaf < 64; ++leaf)
    for (int i = 0; i <= 8 * leaf; ++i)
      voxels.push_back({Coord{8 * leaf, 0, 0} + voxelLocal(i), std::sin(float(i * leaf))});
  return voxels;
}

TEST_F(Write, VoxelsAreTheSameWhereTheyAreLoadedLater) {
  // Blender and Houdini load voxels when they need them. Only OpenVDB 13 has no such loading.
  for (const HalfMode half : {HalfMode::kOff, HalfMode::kOn}) {
    const auto grid = test::gridOf("density", leavesOfManySizes());
    const auto now = writeAndLoad(grid, {.half = half, .overwrite = true});
    openvdb::io::File file(path().string());
    file.open(/*delayLoad=*/true);
    const auto later = openvdb::gridPtrCast<FloatGrid>(file.readGrid("density"));
    ASSERT_TRUE(later->tree().hasSameTopology(now->tree()));
    for (auto voxel = later->cbeginValueOn(); voxel; ++voxel)
      ASSERT_EQ(*voxel, now->tree().getValue(voxel.getCoord())) << voxel.getCoord();
  }
}

TEST_F(Write, StatisticsAreThoseOfTheGridThatIsReadAgain) {
  const auto back = writeAndLoad(test::gridOf("density", leavesOfManySizes()));
  const auto item = [&](const char* name) { return back->metaValue<openvdb::Int64>(name); };
  EXPECT_EQ(item(FloatGrid::META_FILE_MEM_BYTES), openvdb::Int64(back->memUsage()));
  EXPECT_EQ(item(FloatGrid::META_FILE_VOXEL_COUNT), openvdb::Int64(back->activeVoxelCount()));
  const openvdb::CoordBBox box = back->evalActiveVoxelBoundingBox();
  EXPECT_EQ(back->metaValue<openvdb::Vec3i>(FloatGrid::META_FILE_BBOX_MIN), box.min().asVec3i());
  EXPECT_EQ(back->metaValue<openvdb::Vec3i>(FloatGrid::META_FILE_BBOX_MAX), box.max().asVec3i());
}

TEST_F(Write, AnExistingFileStaysUnlessOverwriteIsGiven) {
  const auto old = test::gridOf("old", {{{0, 0, 0}, 1.0f}});
  const auto fresh = test::gridOf("new", {{{0, 0, 0}, 1.0f}});
  write(old);
  EXPECT_THAT([&] { write(fresh); }, test::ThrowsSaying<RuntimeFailure>("out.vdb", "exists"));
  EXPECT_EQ(inspectVdb(path()).grids.front().name, "old");
  write(fresh, {.overwrite = true});
  EXPECT_EQ(inspectVdb(path()).grids.front().name, "new");
  EXPECT_EQ(directory_.names().size(), 1u);
}

TEST_F(Write, OtherExtensionsAreRefused) {
  for (const char* name : {"out.esvr", "out", "out.VDB.gz"})
    EXPECT_THROW(write(grid_, {}, name), UsageError) << name;
  EXPECT_EQ(directory_.names().size(), 0u);
}

TEST_F(Write, ADirectoryThatIsNotThereIsNamed) {
  EXPECT_THAT([&] { write(grid_, {}, "nowhere/out.vdb"); },
              test::ThrowsSaying<RuntimeFailure>("nowhere/out.vdb"));
}

TEST_F(Write, ADirectoryWithoutPermissionIsAnError) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  std::filesystem::permissions(
      directory_.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_THROW(write(grid_), RuntimeFailure);
  std::filesystem::permissions(directory_.path(), std::filesystem::perms::owner_all);
}

TEST_F(Write, AFullDiskIsNoticedAndLeavesNothing) {
  const auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}, {{5000, 0, 0}, 1.0f}});
  for (const char* name : {"out.vdb", "out.nvdb"}) {
    for (const rlim_t limit : {rlim_t{0}, rlim_t{100}, rlim_t{600}}) {
      const test::FileSizeLimit full(limit);
      EXPECT_THAT([&] { write(grid, {}, name); },
                  test::ThrowsSaying<RuntimeFailure>(name, "disk is full"))
          << limit;
    }
    EXPECT_EQ(directory_.names().size(), 0u);
  }
}

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
              test::ThrowsSaying<UsageError>("vec3s"));
}

TEST_F(OtherPackedFile, OfFloatsHasTheVoxelsThatReadGridHasAndIsWrittenAsNanoVdb) {
  test::save(path("in.vdb"), {test::smallGrid(2.0f)});
  const PackedGrid numbers = readPacked(path("in.vdb"), "density");
  const std::vector<GridToWrite> grids{&numbers};
  for (const char* name : {"out.vdb", "out.nvdb"}) {
    writeGrids(path(name), {}, grids);
    const VolumeGrid read = readGrid(path(name), "density"), source = readGrid(path("in.vdb"), 0);
    EXPECT_EQ(test::volumeDifference(read.volume, source.volume), "") << name;
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
  const auto places = test::registeredGrid<openvdb::Vec3IGrid>();
  places->setName("places");
  places->tree().setValue({0, 0, 0}, {1, 2, 3});
  test::save(path("in.vdb"), {places});
  EXPECT_THAT([&] { (void)readPacked(path("in.vdb"), "places"); },
              test::ThrowsSaying<BadInput>("places"));
}

}  // namespace
}  // namespace esvr
