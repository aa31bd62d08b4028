// Plan: trees made with OpenVDB are read, and their values are compared exactly: leaves with every packing,
// tiles of every level, inactive voxels with any content, level sets, values that float cannot hold, and
// coordinates at both ends of the index space.
//
// The name that a user gives finds the right grid, also for empty names, shared names and names that look
// like numbered ones. Grids that cannot be fitted are listed by name and type.
//
// Grids of vectors that OpenVDB wrote (floats, doubles, halves, with tiles and a background) are read by
// components, and written so that OpenVDB reads the same vectors. Values that are not finite are refused with
// the component and the voxel. Grids that are not of vectors, are empty or are level sets are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <thread>

#include "esvr/device.h"
#include "esvr/error.h"
#include "support/messages.h"
#include "support/non_finite.h"
#include "vdb/foreign_grids.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

using openvdb::FloatGrid;
using openvdb::Vec3DGrid;
using openvdb::Vec3SGrid;
using test::kInf;
using test::kNan;
using testing::ElementsAre;
using testing::HasSubstr;

/// The inactive values of a tree that are not its background, as OpenVDB iterates over them.
template <class Grid>
InactiveValues inactiveIn(const Grid& grid) {
  InactiveValues found;
  for (auto value = grid.cbeginValueOff(); value; ++value) {
    if (*value == grid.background()) continue;
    openvdb::CoordBBox box;
    value.getBoundingBox(box);
    const auto corner = [](const openvdb::Coord& c) { return Coord{c.x(), c.y(), c.z()}; };
    found.add(double(*value), Box{corner(box.min()), corner(box.max())});
  }
  return found;
}

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
    EXPECT_EQ(grid.inactive, inactiveIn(*source));
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
              test::ThrowsSaying<MemoryExceeded>("134217729 bricks", "density", "GB"));
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
  EXPECT_EQ(grid.inactive, inactiveIn(*source));
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
  // Nothing around it says that it is inside.
  auto island = openvdb::gridPtrCast<FloatGrid>(sphere->deepCopyGrid());
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
              test::ThrowsSaying<MemoryExceeded>("density", "GB of files in", "free"));
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
              test::ThrowsSaying<BadInput>("3 voxels", "(-8, 70, 3)", "density", "in.vdb"));
}

TEST_F(Voxels, NonFiniteOnesBecomeZeroTheBackgroundOrAValueWhenAsked) {
  auto source = test::smallGrid(0.5f);
  source->tree().setValue({9, 1, 1}, kNan);
  source->tree().addTile(1, {64, 0, 0}, kInf, true);
  const auto expectValue = [&](const ReadOptions& options, float value) {
    const auto grid = saveAndRead(source, options);
    EXPECT_EQ(grid.nonFiniteReplaced, 1u + 512u);
    EXPECT_EQ(valueAt(grid.volume, {9, 1, 1}), value);
    EXPECT_EQ(valueAt(grid.volume, {64, 0, 0}), value);
    EXPECT_EQ(activeVoxelCount(grid.volume), source->activeVoxelCount());
  };
  expectValue({.nonFinite = NonFinite::kValue}, 0.0f);
  expectValue({.nonFinite = NonFinite::kBackground}, 0.5f);
  expectValue({.nonFinite = NonFinite::kValue, .nonFiniteValue = -2.0f}, -2.0f);
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

TEST_F(Voxels, DoublesSayWhatFloatsLose) {
  openvdb::initialize();
  auto source = openvdb::DoubleGrid::create(0.1);
  source->tree().setValue({0, 0, 0}, 0.1);
  source->tree().setValue({0, 0, 1}, 1e-50);
  source->tree().setValue({0, 0, 2}, 0.25);
  const Narrowing lost = saveAndRead(source).narrowing;
  EXPECT_EQ(lost.errors.count(), 2);
  EXPECT_EQ(lost.largest(), double(0.1f) - 0.1);
  EXPECT_DOUBLE_EQ(lost.relative, lost.largest() / 0.1) << "1e-50 is not a normal float";
  EXPECT_EQ(lost.min, 1e-50);
  EXPECT_EQ(lost.max, 0.25);
  EXPECT_EQ(lost.relativeAbove(0.5), 2.0 * lost.largest());
  EXPECT_EQ(between(lost, lost).largest(), 0.0);
  EXPECT_EQ(between(lost, {}).largest(), lost.largest());
  EXPECT_DOUBLE_EQ(lost.relativeAbove({}), lost.relative);
  Narrowing denormal;
  denormal.add(1e-42, 1e-42f, {});
  EXPECT_EQ(denormal.relativeAbove({}), 1.0) << "no normal float is there";
}

TEST_F(Voxels, DoublesThatAreAllTooSmallForFloatAreRefused) {
  openvdb::initialize();
  for (const double value : {1e-50, -1.23e-41}) {
    auto source = openvdb::DoubleGrid::create(0.0);
    source->tree().setValue({5, 6, 7}, value);
    EXPECT_THAT([&] { (void)saveAndRead(source); },
                test::ThrowsSaying<CannotConvert>("too small for float"));
  }
}

TEST_F(Voxels, DoublesBeyondFloatCountAsNonFinite) {
  openvdb::initialize();
  auto source = openvdb::DoubleGrid::create(0.0);
  source->setName("density");
  source->tree().setValue({5, 6, 7}, 1e300);
  EXPECT_THAT([&] { (void)saveAndRead(source); }, test::ThrowsSaying<BadInput>("(5, 6, 7)"));
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
  EXPECT_THAT([&] { (void)saveAndRead(source); }, test::ThrowsSaying<BadInput>("2^31"));
}

TEST_F(Voxels, AGridWithoutAnActiveVoxelIsListedAndRefused) {
  auto source = test::smallGrid();
  source->clear();
  test::save(path(), {source});
  EXPECT_THAT(inspectVdb(path()).grids.front().skipReason, HasSubstr("no active voxel"));
  EXPECT_THAT([&] { (void)readGrid(path(), "density"); },
              test::ThrowsSaying<BadInput>("no active voxel"));
}

TEST_F(Voxels, GridsThatShareATreeBothRead) {
  auto first = test::smallGrid(), second = test::smallGrid();
  second->setName("heat");
  second->setTree(first->treePtr());
  second->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  test::save(path(), {first, second});
  const auto a = readGrid(path(), "density"), b = readGrid(path(), "heat");
  EXPECT_EQ(test::volumeDifference(b.volume, a.volume), "");
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

/// Grids with these names. The voxel (0, 0, 0) of the first one holds 1, of the second one 2, ...
openvdb::GridPtrVec gridsNamed(const std::vector<std::string>& names) {
  openvdb::GridPtrVec grids;
  for (const auto& name : names) {
    auto grid = test::smallGrid();
    grid->setName(name);
    grid->tree().setValue({0, 0, 0}, float(grids.size() + 1));
    grids.push_back(grid);
  }
  return grids;
}

/// Names of grids in a file and their unique names.
struct Order {
  std::vector<std::string> names, unique;
};

class Names : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return directory_ / "in.vdb"; }
  [[nodiscard]] std::vector<std::string> uniqueNames() const {
    std::vector<std::string> names;
    for (const auto& grid : inspectVdb(path()).grids) names.push_back(grid.uniqueName);
    return names;
  }
  [[nodiscard]] float mark(const std::string& name) const {
    return valueAt(readGrid(path(), name).volume, {0, 0, 0});
  }
  test::TemporaryFolder directory_;
};

TEST_F(Names, StandInFileOrder) {
  test::save(path(), gridsNamed({"zebra", "ant", "mole"}));
  EXPECT_THAT(uniqueNames(), ElementsAre("zebra", "ant", "mole"));
  EXPECT_EQ(mark("ant"), 2.0f);
}

/// OpenVDB's own look-up finds "a[1]" for the grid of this very name and for the second "a".
TEST_F(Names, ThatLookNumberedWinAndNoGridIsTakenForAnother) {
  const std::vector<Order> orders{{{"a", "a", "a[1]"}, {"a[0]", "a#2", "a[1]"}},
                                  {{"a[0]", "a", "a"}, {"a[0]", "a#2", "a[1]"}}};
  for (const auto& [names, unique] : orders) {
    test::save(path(), gridsNamed(names));
    EXPECT_EQ(uniqueNames(), unique);
    for (std::size_t g = 0; g < unique.size(); ++g) {
      EXPECT_EQ(mark(unique[g]), float(g + 1));
      EXPECT_EQ(valueAt(readGrid(path(), g).volume, {0, 0, 0}), float(g + 1));
    }
  }
}

/// A written file has no grid that OpenVDB finds for the name of another.
TEST_F(Names, OfWrittenGridsAreToldApartByOpenVdb) {
  std::vector<VolumeGrid> grids;
  for (const char* name : {"a", "a", "a[1]"})
    grids.push_back(test::gridOf(name, {{{0, 0, 0}, float(grids.size() + 1)}}));
  writeGrids(path(), {}, grids);
  for (std::size_t g = 0; g < grids.size(); ++g)
    EXPECT_EQ(valueAt(readGrid(path(), g).volume, {0, 0, 0}), float(g + 1));
  const auto found = openvdb::gridPtrCast<openvdb::FloatGrid>(test::load(path(), "a[1]"));
  EXPECT_EQ(found->tree().getValue({0, 0, 0}), 3.0f);
}

TEST_F(Names, OfPlacesThatAreNotThereAreRefused) {
  test::save(path(), gridsNamed({"a", "b"}));
  EXPECT_THAT([&] { (void)readGrid(path(), std::size_t{2}); },
              test::ThrowsSaying<BadInput>("has no grid number 3, only 2 grids"));
}

TEST_F(Names, OfAFileWithoutGridsAreNone) {
  test::save(path(), {});
  EXPECT_TRUE(inspectVdb(path()).grids.empty());
  EXPECT_THAT([&] { (void)readGrid(path(), "a"); }, test::ThrowsSaying<BadInput>("none"));
}

TEST_F(Names, OfGridsThatCannotBeFittedComeWithTheirType) {
  openvdb::GridPtrVec grids;
  for (const char* type : {"bool", "mask", "int32", "int64", "vec3i", "ptdataidx32"})
    grids.push_back(test::emptyGrid(std::string("Tree_") + type + "_5_4_3", type));
  grids.push_back(test::smallGrid());
  test::save(path(), grids);
  const auto listed = inspectVdb(path()).grids;
  ASSERT_EQ(listed.size(), 7u);
  EXPECT_THAT(listed[0].skipReason, HasSubstr("bool"));
  EXPECT_THAT(listed[1].skipReason, HasSubstr("mask"));
  EXPECT_THAT(listed[2].skipReason, HasSubstr("int32"));
  EXPECT_THAT(listed[3].skipReason, HasSubstr("int64"));
  EXPECT_THAT(listed[4].skipReason, HasSubstr("vec3i"));
  EXPECT_THAT(listed[5].skipReason, HasSubstr("points"));
  EXPECT_EQ(listed[6].skipReason, "");
  EXPECT_THAT([&] { (void)readGrid(path(), "vec3i"); },
              test::ThrowsSaying<BadInput>("of type vec3i"));
  EXPECT_EQ(activeVoxelCount(readGrid(path(), "density").volume), 3u);
}

TEST_F(Names, OfTypesThatOpenVdbDoesNotKnowAreListedToo) {
  // The tree has another shape, as in other programs' files: the type of the first grid is
  // rewritten.
  const auto other = test::smallGrid();
  other->setName("other");
  test::save(path(), {other, test::smallGrid()});
  auto bytes = test::bytesIn(path());
  const std::string known = "Tree_float_5_4_3", odd = "Tree_float_4_3_3";
  const auto asByte = [](std::byte b, char c) { return b == std::byte(c); };
  const auto at = std::search(bytes.begin(), bytes.end(), known.begin(), known.end(), asByte);
  ASSERT_NE(at, bytes.end());
  std::memcpy(&*at, odd.data(), odd.size());
  test::writeBytes(path(), bytes);
  const auto listed = inspectVdb(path()).grids;
  ASSERT_EQ(listed.size(), 2u);
  EXPECT_EQ(listed[0].valueType, "float");
  EXPECT_THAT(listed[0].skipReason, HasSubstr("Tree_float_4_3_3"));
  EXPECT_EQ(activeVoxelCount(readGrid(path(), "density").volume), 3u);
}

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
              test::ThrowsSaying<BadInput>("\"wind.y\"", "the first is at (5, 6, 7)"));
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
                test::ThrowsSaying<BadInput>(name, why));
  };
  refused("level", "a level set of vectors");
  refused("empty", "no active voxel");
  refused("density", "numbers, not vectors");
  EXPECT_THAT([&] { (void)readGrid(path("in.vdb"), "level"); },
              test::ThrowsSaying<BadInput>("level set of vectors"));
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
              test::ThrowsSaying<UsageError>("65504"));
}

TEST_F(OtherVectors, OfMoreMemoryThanAllowedAreRefused) {
  test::save(path("in.vdb"), {windGrid<Vec3SGrid>()});
  constexpr std::uint64_t kTwoComponents = 20'000;  // three bricks take 6 KB in each
  EXPECT_NO_THROW((void)readComponent(path("in.vdb"), "wind", 0, {.maxBytes = kTwoComponents}));
  EXPECT_THROW((void)readVector(path("in.vdb"), "wind", {.maxBytes = kTwoComponents / 2}),
               MemoryExceeded);
}

// The directory of a file.

openvdb::GridBase::Ptr oneVoxel(int number) {
  const auto grid = FloatGrid::create();
  grid->setName("g" + std::to_string(number));
  grid->tree().setValue({number, 0, 0}, float(number + 1));
  return grid;
}

openvdb::GridPtrVec manyGrids(int count) {
  openvdb::GridPtrVec grids;
  for (int n = 0; n < count; ++n) grids.push_back(oneVoxel(n));
  return grids;
}

TEST_F(Voxels, ADirectoryFindsEachGrid) {
  test::save(path(), manyGrids(5));
  const ReadOptions options{.directory = inspectVdb(path()).directory};
  ASSERT_NE(options.directory, nullptr);
  for (std::size_t place = 0; place < 5; ++place) {
    const VolumeGrid grid = readGrid(path(), place, options);
    EXPECT_EQ(grid.descriptor.name, "g" + std::to_string(place));
    EXPECT_EQ(activeRange(grid.volume).max, float(place + 1));
  }
}

TEST_F(Voxels, TheDirectoryOfAnotherFileIsNotUsed) {
  test::save(path(), manyGrids(5));
  const ReadOptions options{.directory = inspectVdb(path()).directory};
  std::filesystem::remove(path());
  test::save(path(), {oneVoxel(7)});
  EXPECT_EQ(readGrid(path(), 0, options).descriptor.name, "g7");
  EXPECT_THROW((void)readGrid(path(), 4, options), BadInput);
}

// Reading all grids of a file takes time in proportion to their number, and not to its square. The
// time of a read also has a part that depends on nothing, so that the ratio is below that of the numbers.
TEST_F(Voxels, SlowTheTimeOfManyGridsIsProportionalToTheirNumber) {
  const auto seconds = [&](int count) {
    test::save(path(), manyGrids(count));
    const ReadOptions options{.directory = inspectVdb(path()).directory};
    double least = 1e9;
    for (int repeat = 0; repeat < 3; ++repeat) {
      const auto begin = std::chrono::steady_clock::now();
      for (int place = 0; place < count; ++place)
        (void)readGrid(path(), std::size_t(place), options);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
      least = std::min(least, took.count());
    }
    std::filesystem::remove(path());
    return least;
  };
  EXPECT_LE(seconds(2000) / seconds(500), 8.0) << "16 if each read looks at all grids";
}

}  // namespace
}  // namespace esvr
