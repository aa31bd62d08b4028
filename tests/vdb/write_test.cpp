/// Plan: OpenVDB's own reader reads the written files, at once and later when voxels are needed:
/// values, states, tiles, types, half floats and statistics. Writing can fail in several ways, each
/// of which leaves no file.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <unistd.h>

#include <cmath>

#include "esvr/error.h"
#include "support/file_size_limit.h"
#include "vdb/expect_same.h"
#include "vdb/made_files.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

using openvdb::FloatGrid;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::vector<test::VoxelValue> fullBrick(Coord corner, float value) {
  std::vector<test::VoxelValue> voxels;
  for (int i = 0; i < kBrickVoxels; ++i) voxels.push_back({corner + voxelLocal(i), value});
  return voxels;
}

class Write : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return directory_ / "out.vdb"; }
  FloatGrid::Ptr writeAndLoad(const VolumeGrid& grid, const WriteOptions& options = {}) {
    writeGrids(path(), {}, {&grid, 1}, options);
    return openvdb::gridPtrCast<FloatGrid>(test::load(path(), grid.descriptor.name));
  }
  test::TemporaryFolder directory_;
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

TEST_F(Write, ConstantLeavesBecomeTilesUnlessToldOtherwise) {
  auto voxels = fullBrick({8, 16, -8}, 0.75f);
  voxels.push_back({{0, 0, 0}, 2.0f});
  const auto grid = test::gridOf("density", voxels);
  const auto tiled = writeAndLoad(grid);
  EXPECT_EQ(tiled->tree().leafCount(), 1u);
  EXPECT_EQ(tiled->activeVoxelCount(), 513u);
  EXPECT_EQ(tiled->tree().getValue({15, 23, -1}), 0.75f);
  test::expectSameBits(readGrid(path(), "density").volume, grid.volume);
  const auto leaves = writeAndLoad(grid, {.overwrite = true, .constantTiles = false});
  EXPECT_EQ(leaves->tree().leafCount(), 2u);
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
    test::expectSameBits(readGrid(path(), "density").volume, grid.volume);
  }
}

TEST_F(Write, AMergedTileOfManyBricksKeepsALeafToo) {
  std::vector<test::VoxelValue> voxels;
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
    writeGrids(path(), {}, {&grid, 1}, {.overwrite = true});
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
  writeGrids(path(), {}, {&grid, 1});
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
  EXPECT_NO_THROW(writeGrids(path(), {}, {&grid, 1}, {.half = HalfMode::kOn}));
  grid = test::gridOf("heat", {{{0, 0, 0}, -70000.0f}});
  EXPECT_THAT(
      [&] {
        writeGrids(path(), {}, {&grid, 1}, {.half = HalfMode::kOn, .overwrite = true});
      },
      ThrowsMessage<UsageError>(AllOf(HasSubstr("heat"), HasSubstr("65504"))));
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
  const auto back = writeAndLoad(test::gridOf("density", {{{0, 0, 0}, 1.0f}}));
  const auto packing =
      back->getMetadata<openvdb::StringMetadata>(openvdb::GridBase::META_FILE_COMPRESSION);
  ASSERT_TRUE(packing);
  EXPECT_EQ(packing->value(), "blosc + active values");
}

/// Voxels in many leaves whose compressed bytes differ.
std::vector<test::VoxelValue> leavesOfManySizes() {
  std::vector<test::VoxelValue> voxels;
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
  writeGrids(path(), {}, {&old, 1});
  EXPECT_THAT(
      [&] {
        writeGrids(path(), {}, {&fresh, 1});
      },
      ThrowsMessage<RuntimeFailure>(AllOf(HasSubstr("out.vdb"), HasSubstr("exists"))));
  EXPECT_EQ(inspectVdb(path()).grids.front().name, "old");
  writeGrids(path(), {}, {&fresh, 1}, {.overwrite = true});
  EXPECT_EQ(inspectVdb(path()).grids.front().name, "new");
  EXPECT_EQ(directory_.names().size(), 1u);
}

TEST_F(Write, OtherExtensionsAreRefused) {
  const auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  for (const char* name : {"out.esvr", "out", "out.VDB.gz"})
    EXPECT_THROW(writeGrids(directory_ / name, {}, {&grid, 1}), UsageError) << name;
  EXPECT_EQ(directory_.names().size(), 0u);
}

TEST_F(Write, ADirectoryThatIsNotThereIsNamed) {
  const auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  EXPECT_THAT(
      [&] {
        writeGrids(directory_ / "nowhere/out.vdb", {}, {&grid, 1});
      },
      ThrowsMessage<RuntimeFailure>(HasSubstr("nowhere/out.vdb")));
}

TEST_F(Write, ADirectoryWithoutPermissionIsAnError) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  const auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  std::filesystem::permissions(
      directory_.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_THROW(writeGrids(path(), {}, {&grid, 1}), RuntimeFailure);
  std::filesystem::permissions(directory_.path(), std::filesystem::perms::owner_all);
}

TEST_F(Write, AFullDiskIsNoticedAndLeavesNothing) {
  const auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}, {{5000, 0, 0}, 1.0f}});
  for (const char* name : {"out.vdb", "out.nvdb"}) {
    for (const rlim_t limit : {rlim_t{0}, rlim_t{100}, rlim_t{600}}) {
      const test::FileSizeLimit full(limit);
      EXPECT_THAT(
          [&] {
            writeGrids(directory_ / name, {}, {&grid, 1});
          },
          ThrowsMessage<RuntimeFailure>(AllOf(HasSubstr(name), HasSubstr("disk is full"))))
          << limit;
    }
    EXPECT_EQ(directory_.names().size(), 0u);
  }
}

}  // namespace
}  // namespace esvr
