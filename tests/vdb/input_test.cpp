/// Plan: everything that is not a valid VDB file is refused with a BadInput that names it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <utility>

#include "esvr/error.h"
#include "vdb/made_files.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

using StringGrid = openvdb::Grid<openvdb::tree::Tree4<std::string, 5, 4, 3>::Type>;

class Input : public testing::Test {
 protected:
  void expectRefused(const std::filesystem::path& path, const std::string& why) const {
    const auto says = ThrowsMessage<BadInput>(AllOf(HasSubstr(path.string()), HasSubstr(why)));
    EXPECT_THAT([&] { (void)inspectVdb(path); }, says);
    EXPECT_THAT([&] { (void)readGrid(path, "density"); }, says);
  }
  [[nodiscard]] std::filesystem::path fileWith(const std::string& text) const {
    std::ofstream(directory_ / "text.vdb") << text;
    return directory_ / "text.vdb";
  }
  test::TemporaryFolder directory_;
};

TEST_F(Input, IsRefusedIfItIsMissing) { expectRefused(directory_ / "missing.vdb", "no such file"); }
TEST_F(Input, IsRefusedIfItIsADirectory) { expectRefused(directory_.path(), "is a directory"); }
TEST_F(Input, IsRefusedIfItIsADevice) { expectRefused("/dev/null", "not a regular file"); }
TEST_F(Input, IsRefusedIfItIsEmpty) { expectRefused(fileWith(""), "is empty"); }
TEST_F(Input, IsRefusedIfItIsOneByte) {
  expectRefused(fileWith(" "), "neither an OpenVDB nor a NanoVDB");
}
TEST_F(Input, IsRefusedIfItIsText) {
  expectRefused(fileWith("#Blender's idea of a volume\n"), "neither an OpenVDB nor a NanoVDB");
}

TEST_F(Input, IsRefusedIfItIsTooOld) {
  test::save(directory_ / "old.vdb", {test::smallGrid()});
  auto bytes = test::bytesOf(directory_ / "old.vdb");
  bytes[8] = std::byte{221};  // the version follows the magic number
  test::writeBytes(directory_ / "old.vdb", bytes);
  expectRefused(directory_ / "old.vdb", "version 221");
}

TEST_F(Input, OfANewerFormatVersionIsTried) {
  // OpenVDB 13 writes version 225 into every file, and nothing else changed for float grids.
  test::save(directory_ / "new.vdb", {test::smallGrid()});
  auto bytes = test::bytesOf(directory_ / "new.vdb");
  bytes[8] = std::byte{225};
  test::writeBytes(directory_ / "new.vdb", bytes);
  EXPECT_EQ(activeVoxelCount(readGrid(directory_ / "new.vdb", "density").volume), 3u);
}

/// Grids of several types, two of which share a tree.
openvdb::GridPtrVec gridsOfAllKinds() {
  auto density = test::smallGrid();
  for (int i = 0; i < 3000; ++i)
    density->tree().setValue({i % 20, i / 20, (i * i) % 41}, float(i % 13) / 4.0f);
  density->tree().addTile(1, {64, 0, 0}, 0.5f, true);
  auto half = density->deepCopy();
  half->setName("half");
  half->setSaveFloatAsHalf(true);
  auto instance = openvdb::FloatGrid::create(density->treePtr());
  instance->setName("instance");
  instance->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  openvdb::GridPtrVec all{density, half, instance};
  const auto add = [&]<class Grid>(const std::shared_ptr<Grid>& grid, const char* name,
                                   const typename Grid::ValueType& value) {
    grid->setName(name);
    for (int i = 0; i < 500; ++i) grid->tree().setValue({i % 9, i / 9, 5 * (i % 4)}, value);
    all.push_back(grid);
  };
  add(openvdb::DoubleGrid::create(1.0), "double", 0.1);
  add(openvdb::Vec3SGrid::create(), "velocity", {1.0f, 2.0f, 3.0f});
  add(openvdb::Vec3IGrid::create(), "index", {1, 2, 3});
  add(openvdb::Int32Grid::create(), "id", 7);
  add(openvdb::Int64Grid::create(), "big", 7);
  add(openvdb::BoolGrid::create(), "flag", true);
  add(openvdb::MaskGrid::create(), "mask", true);
  add(StringGrid::create("none"), "words", "some");
  return all;
}

void stream(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
            const openvdb::MetaMap& metadata = {}) {
  std::ofstream file(path, std::ios::binary);
  openvdb::io::Stream(file).write(grids, metadata);
}

/// A file that OpenVDB writes to a stream has no positions of grids; all else is as in a file.
TEST_F(Input, OfAStreamIsReadLikeThatOfAFile) {
  openvdb::initialize();
  const auto file = directory_ / "file.vdb", streamed = directory_ / "stream.vdb";
  openvdb::MetaMap metadata;
  metadata.insertMeta("note", openvdb::StringMetadata("about this file"));
  const auto grids = gridsOfAllKinds();
  test::save(file, grids, metadata);
  stream(streamed, grids, metadata);
  const VdbSummary expected = inspectVdb(file), got = inspectVdb(streamed);
  EXPECT_EQ(got.metadata.size(), expected.metadata.size());
  ASSERT_EQ(got.grids.size(), expected.grids.size());
  for (std::size_t g = 0; g < got.grids.size(); ++g) {
    const GridSummary &a = got.grids[g], &b = expected.grids[g];
    EXPECT_EQ(a.uniqueName, b.uniqueName);
    EXPECT_EQ(a.valueType, b.valueType) << a.name;
    EXPECT_EQ(a.activeVoxels, b.activeVoxels) << a.name;
    EXPECT_EQ(a.storedBytes, b.storedBytes) << a.name;
    if (a.isScalar) {
      EXPECT_EQ(readGrid(streamed, a.uniqueName).volume.values,
                readGrid(file, a.uniqueName).volume.values);
    }
    const auto carried = readCarried(streamed, {&g, 1}), same = readCarried(file, {&g, 1});
    EXPECT_EQ(carried.front().bytes, same.front().bytes) << a.name;
    if (a.name != "words") {
      EXPECT_EQ(carried.front().blocksAt, same.front().blocksAt) << a.name;
    }
  }
}

TEST_F(Input, OfAStreamIsRefusedBehindATreeWhoseEndIsUnknown) {
  openvdb::initialize();
  auto grids = gridsOfAllKinds();
  std::swap(grids.front(), grids.back());
  stream(directory_ / "words_first.vdb", grids);
  expectRefused(directory_ / "words_first.vdb", "or with this grid as the last one");
}

/// The head of each grid has a name that reaches over all later grids.
TEST_F(Input, IsRefusedIfTheHeadsOfGridsOverlap) {
  std::string bytes;
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  constexpr std::int32_t kGrids = 200, kRowBytes = 4 + 4 + 1 + 4 + 24, kHeadBytes = 12;
  put(std::int64_t(openvdb::OPENVDB_MAGIC));
  for (const std::uint32_t number : {224u, 10u, 0u}) put(number);
  bytes += '\x01' + std::string(36, '0');
  put(std::uint32_t{0});  // items of the file
  put(kGrids);
  const std::size_t end = bytes.size() + std::size_t(kGrids) * (kRowBytes + kHeadBytes);
  for (std::int32_t g = 0; g < kGrids; ++g) {
    const auto head = std::int64_t(bytes.size()) + kRowBytes;
    put(std::uint32_t{0});  // name
    put(std::uint32_t{1});
    bytes += 'Z';           // type
    put(std::uint32_t{0});  // parent
    for (const std::int64_t position : {head, head, head + kHeadBytes}) put(position);
    put(std::uint32_t{0});                                         // compression
    put(std::uint32_t{1});                                         // items
    put(std::uint32_t(end + 1 - std::size_t(head) - kHeadBytes));  // length of the item's name
  }
  bytes += std::string(200, 'x');
  expectRefused(fileWith(bytes), "this part of the file ends");
}

TEST_F(Input, RealFileOfAStreamIsRead) {
  ESVR_NEEDS_DATA();
  const auto path = test::dataDir() / "edge/faults/stream_no_offsets.vdb";
  const VdbSummary summary = inspectVdb(path);
  ASSERT_EQ(summary.grids.size(), 1u);
  EXPECT_EQ(summary.grids[0].name, "surface");
  EXPECT_EQ(summary.grids[0].activeVoxels, 0x1836u);
  EXPECT_EQ(activeVoxelCount(readGrid(path, "surface").volume), 0x1836u);
}

TEST_F(Input, MayBeDeletedOnceRead) {
  const auto path = directory_ / "in.vdb";
  test::save(path, {test::smallGrid()});
  const auto grid = readGrid(path, "density");
  std::filesystem::remove(path);
  EXPECT_EQ(valueAt(grid.volume, {7, 0, 0}), 1.0f);
}

}  // namespace
}  // namespace esvr
