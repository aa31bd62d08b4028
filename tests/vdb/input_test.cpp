/// Plan: everything that is not a valid VDB file is refused with a BadInput that names it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>

#include <fstream>

#include "esvr/error.h"
#include "vdb/made_files.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

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

TEST_F(Input, IsRefusedWithoutATableOfGrids) {
  const auto path = directory_ / "stream.vdb";
  std::ofstream file(path, std::ios::binary);
  openvdb::io::Stream(file).write(openvdb::GridPtrVec{test::smallGrid()});
  file.close();
  expectRefused(path, "written to a stream");
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
