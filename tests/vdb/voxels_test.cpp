/// Plan: trees made with OpenVDB are read, and their values are compared exactly: leaves with every
/// packing, tiles of every level, inactive voxels with any content, level sets, values that float
/// cannot hold, and coordinates at both ends of the index space.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <limits>
#include <thread>

#include "esvr/error.h"
#include "esvr/memory_limit.h"
#include "support/non_finite.h"
#include "vdb/expect_same.h"
#include "vdb/made_files.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

using openvdb::FloatGrid;
using test::kInf;
using test::kNan;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

class Voxels : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return directory_ / "in.vdb"; }
  VolumeGrid saveAndRead(const openvdb::GridBase::Ptr& grid, const ReadOptions& options = {}) {
    test::save(path(), {grid});
    return readGrid(path(), grid->getName(), options);
  }
  test::TemporaryFolder directory_;
};

/// How a file packs its values, and what its inactive voxels hold.
struct Packing {
  std::uint32_t compression;
  int inactiveValues;  ///< number of distinct values other than the background
  bool half;
};
std::ostream& operator<<(std::ostream& out, const Packing& p) {
  return out << "flags " << p.compression << ", " << p.inactiveValues << " inactive values"
             << (p.half ? ", half" : "");
}

class EveryPacking : public testing::TestWithParam<Packing> {
 protected:
  /// A grid of 20^3 voxels. Every third one is active, and some inactive ones hold other values.
  /// All values are exact in half.
  template <class Grid>
  static typename Grid::Ptr patterned() {
    auto grid = Grid::create(2.0);
    grid->setName("density");  // its class is unknown: OpenVDB zips no other
    auto accessor = grid->getAccessor();
    for (int i = 0; i < 8000; ++i) {
      const openvdb::Coord at(i / 400 - 10, i / 20 % 20, i % 20);
      const int junk = i % 7 % (GetParam().inactiveValues + 1);
      if (i % 3 == 0)
        accessor.setValueOn(at, float(i % 512) / 4.0f);
      else if (junk > 0)
        accessor.setValueOff(at, float(-junk));
    }
    grid->setSaveFloatAsHalf(GetParam().half);
    return grid;
  }
  template <class Grid>
  void expectReadExactly() {
    const auto source = patterned<Grid>();
    const test::TemporaryFolder directory;
    test::saveCompressed(directory / "in.vdb", {source}, GetParam().compression);
    const auto grid = readGrid(directory / "in.vdb", "density");
    EXPECT_EQ(activeVoxelCount(grid.volume), source->activeVoxelCount());
    EXPECT_EQ(grid.descriptor.background, 2.0);
    EXPECT_EQ(grid.inactive, test::inactiveIn(*source));
    for (auto voxel = source->cbeginValueAll(); voxel; ++voxel) {
      if (!voxel.isVoxelValue()) continue;
      const auto at = voxel.getCoord();
      ASSERT_EQ(valueAt(grid.volume, {at.x(), at.y(), at.z()}),
                voxel.isValueOn() ? float(*voxel) : 2.0f);
    }
  }
};

TEST_P(EveryPacking, OfFloatsReadsExactly) { expectReadExactly<openvdb::FloatGrid>(); }
TEST_P(EveryPacking, OfDoublesReadsExactly) { expectReadExactly<openvdb::DoubleGrid>(); }

std::vector<Packing> everyPacking() {
  using namespace openvdb::io;
  std::vector<Packing> packings;
  for (const std::uint32_t mask : {COMPRESS_NONE, COMPRESS_ACTIVE_MASK})
    for (const std::uint32_t codec : {COMPRESS_NONE, COMPRESS_ZIP, COMPRESS_BLOSC})
      for (const int inactiveValues : {0, 1, 2, 3})
        for (const bool half : {false, true})
          packings.push_back({mask | codec, inactiveValues, half});
  return packings;
}
INSTANTIATE_TEST_SUITE_P(OpenVdb, EveryPacking, testing::ValuesIn(everyPacking()));

TEST_F(Voxels, ActiveTilesBecomeBricks) {
  auto source = test::smallGrid();
  source->tree().addTile(1, {8, 0, 0}, 3.0f, true);      // 8^3
  source->tree().addTile(2, {128, 0, 0}, 4.0f, true);    // 128^3
  source->tree().addTile(2, {-128, 0, 0}, 5.0f, false);  // inactive tiles become background
  const auto grid = saveAndRead(source);
  EXPECT_EQ(grid.volume.brickCount(), 1u + 1u + 16u * 16u * 16u);
  EXPECT_EQ(activeVoxelCount(grid.volume), source->activeVoxelCount());
  EXPECT_EQ(valueAt(grid.volume, {15, 7, 7}), 3.0f);
  EXPECT_EQ(valueAt(grid.volume, {255, 127, 127}), 4.0f);
  EXPECT_EQ(valueAt(grid.volume, {-1, 0, 0}), 0.0f);
  checkInvariants(grid.volume);
}

TEST_F(Voxels, ATileTooLargeForTheLimitIsRefusedBeforeItIsExpanded) {
  auto source = test::smallGrid();
  source->tree().addTile(3, {4096, 0, 0}, 1.0f, true);  // 4096^3 voxels take 288 GB of bricks
  test::save(path(), {source});
  EXPECT_THAT([&] { (void)readGrid(path(), "density"); },
              ThrowsMessage<MemoryExceeded>(
                  AllOf(HasSubstr("134217729 bricks"), HasSubstr("density"), HasSubstr("GB"))));
}

TEST_F(Voxels, TheLimitCountsLeavesToo) {
  const auto source = test::smallGrid();
  test::save(path(), {source});
  ReadOptions options;
  options.maxBytes = 1000;
  EXPECT_THROW((void)readGrid(path(), "density", options), MemoryExceeded);
}

TEST_F(Voxels, InactiveVoxelsReadAsBackgroundWhateverTheyHold) {
  auto source = test::smallGrid(0.125f);
  source->tree().setValueOff({2, 2, 2}, 99.0f);
  source->tree().setValueOff({3, 3, 3}, kNan);
  const auto grid = saveAndRead(source);
  EXPECT_EQ(valueAt(grid.volume, {2, 2, 2}), 0.125f);
  EXPECT_EQ(valueAt(grid.volume, {3, 3, 3}), 0.125f);
  EXPECT_EQ(valueAt(grid.volume, {1, 2, 4}), 0.5f);
  EXPECT_EQ(grid.inactive.count(), 2u);
  EXPECT_EQ(grid.inactive.nonFinite(), 1u);
}

TEST_F(Voxels, InactiveTilesOfEveryLevelAndLeavesWithoutActiveVoxelsAreCounted) {
  auto source = test::smallGrid();
  source->tree().addTile(1, {8, 0, 0}, 3.0f, false);
  source->tree().addTile(2, {256, 0, 0}, 4.0f, false);
  source->tree().addTile(3, {8192, 0, 0}, -5.0f, false);
  source->tree().addTile(3, {-4096, 0, 0}, 0.0f, false);  // the background
  source->tree().touchLeaf({0, 64, 0})->fill(2.0f, false);
  const auto grid = saveAndRead(source);
  const std::uint64_t side = 4096;
  EXPECT_EQ(grid.inactive.count(), 512u + 128u * 128u * 128u + side * side * side + 512u);
  EXPECT_EQ(grid.inactive.min(), -5.0);
  EXPECT_EQ(grid.inactive.max(), 4.0);
  EXPECT_EQ(grid.inactive, test::inactiveIn(*source));
}

TEST_F(Voxels, InactiveValuesAreTheSameWhateverTheTiles) {
  auto tiles = test::smallGrid(), voxels = test::smallGrid();
  tiles->tree().addTile(2, {128, 0, 0}, 3.0f, false);
  voxels->tree().addTile(2, {128, 0, 0}, 3.0f, false);
  voxels->tree().touchLeaf({136, 8, 0});
  EXPECT_EQ(saveAndRead(tiles).inactive, saveAndRead(voxels).inactive);
}

// Where the signs around the empty space agree, a writer's flood fill makes the inside of a level
// set negative. Other values, or negative ones that it does not make, are lost.
TEST_F(Voxels, TheInsideOfALevelSetIsLostOnlyIfAWriterDoesNotRestoreIt) {
  auto sphere = openvdb::tools::createLevelSetSphere<FloatGrid>(12.0f, {0, 0, 0}, 1.0f);
  EXPECT_EQ(saveAndRead(sphere).inactive.count(), 0u);
  auto island = sphere->deepCopy();  // nothing around it says that it is inside
  island->tree().addTile(2, {1280, 0, 0}, -sphere->background(), false);
  EXPECT_EQ(saveAndRead(island).inactive.count(), 128u * 128u * 128u);
  for (auto value = sphere->beginValueOff(); value; ++value)
    if (*value < 0.0f) value.setValue(-2.0f);
  const auto inside = saveAndRead(sphere).inactive;
  EXPECT_GT(inside.count(), 0u);
  EXPECT_EQ(inside.min(), -2.0);
  EXPECT_EQ(inside.max(), -2.0);
  auto plane = test::smallGrid(3.0f);  // a single voxel surrounds nothing
  plane->setGridClass(openvdb::GRID_LEVEL_SET);
  plane->tree().setValueOff({5, 5, 5}, -3.0f);
  plane->tree().addTile(3, {4096, 0, 0}, -3.0f, false);
  EXPECT_GE(saveAndRead(plane).inactive.count(), std::uint64_t{1} << 36);
}

TEST_F(Voxels, NoRoomOnTheDiskIsNoticedBeforeTilesAreExpanded) {
  auto source = test::smallGrid();
  for (int x = 1; x <= 64; ++x) source->tree().addTile(3, {4096 * x, 0, 0}, 1.0f, true);
  test::save(path(), {source});
  const ReadOptions options{.maxBytes = kNoMemoryLimit,
                            .memory = VoxelMemory({directory_ / "", 1u << 20, 1u << 20})};
  EXPECT_THAT([&] { (void)readGrid(path(), "density", options); },
              ThrowsMessage<MemoryExceeded>(
                  AllOf(HasSubstr("density"), HasSubstr("GB of files in"), HasSubstr("free"))));
}

TEST_F(Voxels, LeavesWithoutAnActiveVoxelAreDropped) {
  auto source = test::smallGrid();
  source->tree().touchLeaf({800, 0, 0});
  EXPECT_EQ(saveAndRead(source).volume.brickCount(), 1u);
}

TEST_F(Voxels, ALevelSetKeepsInsideAndOutsideApart) {
  openvdb::initialize();
  auto sphere = openvdb::tools::createLevelSetSphere<FloatGrid>(10.0f, {0, 0, 0}, 1.0f, 3.0f);
  sphere->setName("surface");
  const auto grid = saveAndRead(sphere);
  EXPECT_EQ(grid.descriptor.gridClass, GridClass::kLevelSet);
  EXPECT_EQ(grid.volume.background, 3.0f);
  const auto accessor = sphere->getConstAccessor();
  for (std::size_t b = 0; b < grid.volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i) {
      const Coord at = grid.volume.brickCorner(b) + voxelLocal(i);
      ASSERT_EQ(grid.volume.brickValues(b)[i], accessor.getValue({at.x, at.y, at.z}));
    }
}

TEST_F(Voxels, InactiveVoxelsOfALevelSetKeepOnlyTheirSign) {
  auto source = test::smallGrid(2.0f);
  source->setGridClass(openvdb::GRID_LEVEL_SET);
  source->tree().setValueOff({2, 2, 2}, -0.5f);
  source->tree().setValueOff({3, 3, 3}, 99.0f);
  const auto grid = saveAndRead(source);
  EXPECT_EQ(valueAt(grid.volume, {2, 2, 2}), -2.0f);
  EXPECT_EQ(valueAt(grid.volume, {3, 3, 3}), 2.0f);
}

TEST_F(Voxels, NonFiniteOnesAreRefusedWithTheFirstAndTheirCount) {
  auto source = test::smallGrid();
  source->tree().setValue({9, 1, 1}, kNan);
  source->tree().setValue({-8, 70, 3}, kInf);
  source->tree().setValue({9, 1, 2}, -kInf);
  test::save(path(), {source});
  EXPECT_THAT([&] { (void)readGrid(path(), "density"); },
              ThrowsMessage<BadInput>(AllOf(HasSubstr("3 voxels"), HasSubstr("(-8, 70, 3)"),
                                            HasSubstr("density"), HasSubstr("in.vdb"))));
}

TEST_F(Voxels, NonFiniteOnesBecomeZeroWhenAsked) {
  auto source = test::smallGrid(0.5f);
  source->tree().setValue({9, 1, 1}, kNan);
  source->tree().addTile(1, {64, 0, 0}, kInf, true);
  const auto grid = saveAndRead(source, {.nonFinite = NonFinite::kValue});
  EXPECT_EQ(grid.nonFiniteReplaced, 1u + 512u);
  EXPECT_EQ(valueAt(grid.volume, {9, 1, 1}), 0.0f);
  EXPECT_EQ(valueAt(grid.volume, {64, 0, 0}), 0.0f);
  EXPECT_EQ(activeVoxelCount(grid.volume), source->activeVoxelCount());
}

TEST_F(Voxels, NonFiniteOnesBecomeAValueOrTheBackgroundWhenAsked) {
  auto source = test::smallGrid(0.5f);
  source->tree().setValue({9, 1, 1}, kNan);
  source->tree().addTile(1, {64, 0, 0}, kInf, true);
  const auto background = saveAndRead(source, {.nonFinite = NonFinite::kBackground});
  EXPECT_EQ(background.nonFiniteReplaced, 1u + 512u);
  EXPECT_EQ(valueAt(background.volume, {9, 1, 1}), 0.5f);
  const auto value = saveAndRead(source, {.nonFinite = NonFinite::kValue, .nonFiniteValue = -2.0f});
  EXPECT_EQ(valueAt(value.volume, {64, 0, 0}), -2.0f);
}

TEST_F(Voxels, ABackgroundThatIsNotFiniteIsRefused) {
  const auto source = test::smallGrid(kInf);
  EXPECT_THROW((void)saveAndRead(source), BadInput);
  EXPECT_THROW((void)saveAndRead(source, {.nonFinite = NonFinite::kValue}), BadInput);
}

TEST_F(Voxels, DoublesAreNarrowedToTheNearestFloat) {
  openvdb::initialize();
  auto source = openvdb::DoubleGrid::create(0.1);
  source->setName("density");
  source->tree().setValue({0, 0, 0}, 0.1);
  source->tree().setValue({0, 0, 1}, -1e-30);
  source->tree().setValue({0, 0, 2}, 1e30);
  const auto grid = saveAndRead(source);
  EXPECT_EQ(grid.descriptor.valueType, ValueType::kDouble);
  EXPECT_EQ(grid.descriptor.background, 0.1);
  EXPECT_EQ(valueAt(grid.volume, {0, 0, 0}), 0.1f);
  EXPECT_EQ(valueAt(grid.volume, {0, 0, 1}), -1e-30f);
  EXPECT_EQ(valueAt(grid.volume, {0, 0, 2}), 1e30f);
}

TEST_F(Voxels, DoublesBeyondFloatCountAsNonFinite) {
  openvdb::initialize();
  auto source = openvdb::DoubleGrid::create(0.0);
  source->setName("density");
  source->tree().setValue({5, 6, 7}, 1e300);
  EXPECT_THAT([&] { (void)saveAndRead(source); }, ThrowsMessage<BadInput>(HasSubstr("(5, 6, 7)")));
}

TEST_F(Voxels, ExtremeFloatsAreKeptToTheLastBit) {
  auto source = test::smallGrid();
  const std::vector<float> values{1e-30f,
                                  1e30f,
                                  -0.0f,
                                  std::numeric_limits<float>::denorm_min(),
                                  std::numeric_limits<float>::max(),
                                  -1e-38f};
  for (int i = 0; i < int(values.size()); ++i) source->tree().setValue({0, 0, i}, values[i]);
  const auto grid = saveAndRead(source);
  for (int i = 0; i < int(values.size()); ++i)
    EXPECT_EQ(std::bit_cast<std::uint32_t>(valueAt(grid.volume, {0, 0, i})),
              std::bit_cast<std::uint32_t>(values[i]));
}

TEST_F(Voxels, CoordinatesReachTenMillionEitherWay) {
  auto source = test::smallGrid();
  constexpr std::int32_t kFar = 10'000'000;
  source->tree().setValue({kFar, -kFar, kFar}, 7.0f);
  source->tree().setValue({-kFar, kFar, -kFar}, 8.0f);
  const auto grid = saveAndRead(source);
  EXPECT_EQ(grid.volume.brickCount(), 3u);
  EXPECT_EQ(valueAt(grid.volume, {kFar, -kFar, kFar}), 7.0f);
  EXPECT_EQ(valueAt(grid.volume, {-kFar, kFar, -kFar}), 8.0f);
  EXPECT_EQ(activeBox(grid.volume), (Box{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}}));
  writeGrids(directory_ / "out.vdb", {}, {&grid, 1});
  test::expectSame(readGrid(directory_ / "out.vdb", "density"), grid);
}

TEST_F(Voxels, BothEndsOfIndexSpaceAtOnceAreTooFarApart) {
  auto source = test::smallGrid();
  source->tree().setValue({Box::kMin, 0, 0}, 1.0f);
  source->tree().setValue({Box::kMax, 0, 0}, 1.0f);
  EXPECT_THAT([&] { (void)saveAndRead(source); }, ThrowsMessage<BadInput>(HasSubstr("2^31")));
}

TEST_F(Voxels, AGridWithoutAnActiveVoxelIsListedAndRefused) {
  auto source = test::smallGrid();
  source->clear();
  test::save(path(), {source});
  EXPECT_THAT(inspectVdb(path()).grids.front().skipReason, HasSubstr("no active voxel"));
  EXPECT_THAT([&] { (void)readGrid(path(), "density"); },
              ThrowsMessage<BadInput>(HasSubstr("no active voxel")));
}

TEST_F(Voxels, GridsThatShareATreeBothRead) {
  auto first = test::smallGrid(), second = test::smallGrid();
  second->setName("heat");
  second->setTree(first->treePtr());
  second->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  test::save(path(), {first, second});
  const auto a = readGrid(path(), "density"), b = readGrid(path(), "heat");
  test::expectSameBits(b.volume, a.volume);
  EXPECT_NE(a.descriptor.transform, b.descriptor.transform);
}

TEST_F(Voxels, AreCountedWhereTheWriterLeftNoStatistics) {
  auto source = test::smallGrid();
  source->tree().addTile(1, {8, 0, 0}, 3.0f, true);
  openvdb::io::File file(path().string());
  file.setGridStatsMetadataEnabled(false);
  file.write(openvdb::GridPtrVec{source});
  const auto grid = inspectVdb(path()).grids.front();
  EXPECT_EQ(grid.activeVoxels, 3u + 512u);
  EXPECT_EQ(grid.activeBox, (Box{{1, 0, 0}, {15, 7, 7}}));
}

TEST_F(Voxels, ReadFromManyThreadsAtOnce) {
  test::save(path(), {test::smallGrid()});
  const auto expected = readGrid(path(), "density");
  std::vector<VolumeGrid> grids(8);
  {
    std::vector<std::jthread> threads;
    for (auto& grid : grids) threads.emplace_back([&] { grid = readGrid(path(), "density"); });
  }
  for (const auto& grid : grids) test::expectSame(grid, expected);
}

}  // namespace
}  // namespace esvr
