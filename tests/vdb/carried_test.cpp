/// Plan: grids are read as bytes and written again, between grids of voxels. OpenVDB's own reader
/// reads the results, and the bytes that come back are compared with those of the source.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "esvr/error.h"
#include "vdb/carried_bytes.h"
#include "vdb/empty_grid.h"
#include "vdb/expect_same.h"
#include "vdb/made_files.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

std::vector<CarriedGrid> carryAll(const std::filesystem::path& path) {
  std::vector<std::size_t> places(inspectVdb(path).grids.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  return readCarried(path, places);
}

std::vector<GridToWrite> toWrite(const std::vector<CarriedGrid>& grids) {
  std::vector<GridToWrite> all;
  for (const auto& grid : grids) all.emplace_back(&grid);
  return all;
}

std::vector<std::string> uniqueNamesIn(const std::filesystem::path& path) {
  std::vector<std::string> names;
  for (const auto& grid : inspectVdb(path).grids) names.push_back(grid.uniqueName);
  return names;
}

constexpr std::size_t kVersionAt = 8;  // place of the version of the format in a .vdb file

class Carried : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path in() const { return directory_ / "in.vdb"; }
  [[nodiscard]] std::filesystem::path out() const { return directory_ / "out.vdb"; }

  /// Carries all grids of a file and expects that they come back bit for bit.
  void expectBack(const std::filesystem::path& source) const {
    const auto grids = carryAll(source);
    writeGrids(out(), {}, toWrite(grids), {.overwrite = true});
    EXPECT_EQ(test::withoutVersion(carryAll(out())), test::withoutVersion(grids));
  }

  test::TemporaryFolder directory_;
};

TEST_F(Carried, GridsOfEveryTypeComeBackBitForBit) {
  openvdb::GridPtrVec grids;
  for (const char* type : {"bool", "mask", "int32", "int64", "vec3s", "vec3d", "ptdataidx32"})
    grids.push_back(test::emptyGrid(std::string("Tree_") + type + "_5_4_3", type));
  grids.push_back(test::smallGrid());
  test::save(in(), grids);
  expectBack(in());
  for (const auto& grid : grids) {
    const auto back = test::load(out(), grid->getName());
    EXPECT_EQ(back->type(), grid->type());
    EXPECT_EQ(back->activeVoxelCount(), grid->activeVoxelCount());
  }
}

TEST_F(Carried, GridsComeBackBetweenGridsOfVoxelsWithTheirNames) {
  const auto first = test::emptyGrid("Tree_int32_5_4_3", "a");
  const auto last = test::emptyGrid("Tree_bool_5_4_3", "");
  test::save(in(), {first, last});
  const auto carried = carryAll(in());
  const VolumeGrid a = test::gridOf("a", {{{0, 0, 0}, 1.0f}});
  const VolumeGrid b = test::gridOf("b", {{{5, 0, 0}, 2.0f}});
  const std::vector<GridToWrite> all{&a, &carried[0], &b, &carried[1], &carried[1]};
  writeGrids(out(), {}, all);
  EXPECT_THAT(uniqueNamesIn(out()),
              ElementsAre("a[0]", "a[1]", "b", "(unnamed)[0]", "(unnamed)[1]"));
  EXPECT_EQ(test::load(out(), "a[1]")->type(), first->type());
  EXPECT_EQ(test::load(out(), "[1]")->type(), last->type());
  test::expectSameBits(readGrid(out(), "b").volume, b.volume);
}

TEST_F(Carried, GridThatSharesATreeGetsACopyOfIt) {
  const auto owner = test::smallGrid();
  const auto instance = owner->copyGrid();  // of the same tree
  instance->setName("instance");
  instance->insertMeta("note", openvdb::StringMetadata("of the instance"));
  test::save(in(), {owner, instance});
  ASSERT_LT(inspectVdb(in()).grids[1].storedBytes, inspectVdb(in()).grids[0].storedBytes);
  const std::size_t place = 1;
  const auto carried = readCarried(in(), {&place, 1});
  writeGrids(out(), {}, toWrite(carried));
  const auto back = openvdb::gridPtrCast<openvdb::FloatGrid>(test::load(out(), "instance"));
  EXPECT_EQ(back->tree().getValue({7, 0, 0}), 1.0f);
  EXPECT_EQ(back->metaValue<std::string>("note"), "of the instance");
}

TEST_F(Carried, GridHasTheVoxelsOfTheFile) {
  test::save(in(), {test::smallGrid(0.125f)});
  const auto grids = carryAll(in());
  const VolumeGrid direct = readGrid(in(), "density"), carried = readGrid(grids.front());
  test::expectSameBits(carried.volume, direct.volume);
  EXPECT_EQ(carried.descriptor, direct.descriptor);
  EXPECT_EQ(inspectCarried(grids.front()).activeVoxels, 3u);
}

TEST_F(Carried, GridOfATypeThatOpenVdbDoesNotKnowComesBack) {
  test::save(in(), {test::smallGrid()});
  auto bytes = test::bytesOf(in());
  const std::string known = "Tree_float_5_4_3", odd = "Tree_quux_5_4_33";
  const auto at = std::search(bytes.begin(), bytes.end(), known.begin(), known.end(),
                              [](std::byte b, char c) { return b == std::byte(c); });
  ASSERT_NE(at, bytes.end());
  std::memcpy(&*at, odd.data(), odd.size());
  test::writeBytes(in(), bytes);
  expectBack(in());
  EXPECT_EQ(carryAll(out()).front().treeType, odd);
}

TEST_F(Carried, FiveHundredGridsOfOneNameComeBackInOrder) {
  openvdb::GridPtrVec grids;
  for (int i = 0; i < 500; ++i) {
    grids.push_back(test::emptyGrid("Tree_int32_5_4_3", "many"));
    grids.back()->insertMeta("number", openvdb::Int32Metadata(i));
  }
  test::save(in(), grids);
  expectBack(in());
  EXPECT_EQ(test::load(out(), "many[499]")->metaValue<std::int32_t>("number"), 499);
}

TEST_F(Carried, MetadataOfFiftyMegabytesComeBack) {
  const auto grid = test::emptyGrid("Tree_int32_5_4_3", "large");
  grid->insertMeta("text", openvdb::StringMetadata(std::string(50'000'000, 'x')));
  test::save(in(), {grid});
  expectBack(in());
}

TEST_F(Carried, GridsLargerThanTheLimitAreRefusedWithTheirSize) {
  const auto grid = test::emptyGrid("Tree_int32_5_4_3", "large");
  grid->insertMeta("text", openvdb::StringMetadata(std::string(1'000'000, 'x')));
  test::save(in(), {grid});
  const std::size_t place = 0;
  EXPECT_THAT(
      [&] {
        (void)readCarried(in(), {&place, 1}, {.maxBytes = 100'000});
      },
      ThrowsMessage<MemoryExceeded>(
          AllOf(HasSubstr("in.vdb"), HasSubstr("\"large\""), HasSubstr("1 MB"))));
  const VoxelMemory files({.folder = directory_ / ".", .maxHeapBytes = 1000});
  const auto inFile = readCarried(in(), {&place, 1}, {.maxBytes = 100'000, .memory = files});
  EXPECT_EQ(inFile.front().bytes.size(), inspectVdb(in()).grids.front().storedBytes);
}

TEST_F(Carried, GridsCannotBeWrittenToNanoVdb) {
  test::save(in(), {test::emptyGrid("Tree_vec3s_5_4_3", "v")});
  const auto grids = carryAll(in());
  EXPECT_THAT([&] { writeGrids(directory_ / "out.nvdb", {}, toWrite(grids)); },
              ThrowsMessage<UsageError>(AllOf(HasSubstr("\"v\""), HasSubstr(".vdb"))));
}

TEST_F(Carried, GridsOfAnotherVersionOfTheFormatAreRefused) {
  test::save(in(), {test::smallGrid(), test::emptyGrid("Tree_ptdataidx32_5_4_3", "p")});
  EXPECT_THAT(inspectVdb(in()).grids[1].whyNotCarried, IsEmpty());
  auto bytes = test::bytesOf(in());
  bytes[kVersionAt] = std::byte(223);
  test::writeBytes(in(), bytes);
  const auto grids = inspectVdb(in()).grids;
  EXPECT_THAT(grids[0].whyNotCarried, IsEmpty());
  EXPECT_THAT(grids[1].whyNotCarried, HasSubstr("223"));
  EXPECT_THAT([&] { (void)carryAll(in()); }, ThrowsMessage<BadInput>(HasSubstr("223")));

  const std::size_t place = 0;
  auto future = readCarried(in(), {&place, 1});
  future.front().vdbVersion = 1000;
  EXPECT_THAT([&] { writeGrids(out(), {}, toWrite(future)); },
              ThrowsMessage<RuntimeFailure>(AllOf(HasSubstr("density"), HasSubstr("1000"))));
}

TEST_F(Carried, GridsOfTheFormatOfOpenVdb13AreCarriedByEarlierVersionsToo) {
  test::save(in(), {test::smallGrid(), test::emptyGrid("Tree_ptdataidx32_5_4_3", "p")});
  const auto here = carryAll(in());
  auto bytes = test::bytesOf(in());
  bytes[kVersionAt] = std::byte(225);
  test::writeBytes(in(), bytes);
  EXPECT_EQ(test::withoutVersion(carryAll(in())), test::withoutVersion(here));
  expectBack(in());
}

TEST_F(Carried, RealFilesComeBackBitForBit) {
  ESVR_NEEDS_DATA();
  for (const char* file : {"edge/points_only.vdb", "edge/unregistered_type.vdb",
                           "edge/vec3_velocity.vdb", "sequence/gas_0001.vdb"}) {
    SCOPED_TRACE(file);
    expectBack(test::dataDir() / file);
  }
}

}  // namespace
}  // namespace esvr
