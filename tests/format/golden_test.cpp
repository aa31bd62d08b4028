// Plan: the files in golden/ are read, and this library still writes them. A change of the format
// needs a new version.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "esvr/container.h"
#include "format/sample_files.h"

namespace esvr::test {
namespace {

namespace fs = std::filesystem;

const fs::path kFolder = ESVR_GOLDEN_DIR;

std::vector<std::byte> contentOf(const GoldenFile& golden) {
  return bytesIn(kFolder / (golden.name + ".esvr"));
}

TEST(GoldenFiles, AllInTheFolderAreSmallAndKnown) {
  std::vector<std::string> found, known;
  for (const auto& entry : fs::directory_iterator(kFolder)) {
    found.push_back(entry.path().filename().string());
    EXPECT_LT(entry.file_size(), 4096u) << entry.path();
  }
  for (const auto& golden : goldenFiles()) known.push_back(golden.name + ".esvr");
  EXPECT_THAT(found, testing::UnorderedElementsAreArray(known));
}

TEST(GoldenFiles, DecodeToTheirContent) {
  for (const auto& golden : goldenFiles())
    EXPECT_EQ(difference(decodeEsvr(contentOf(golden), golden.name), golden.content), "")
        << golden.name;
}

TEST(GoldenFiles, OneEllipsoidDecodesToTheNumbersTyped) {
  const auto file = readEsvr(kFolder / "one_ellipsoid.esvr");
  ASSERT_EQ(file.grids.size(), 1u);
  const auto& grid = file.grids[0];
  EXPECT_EQ(grid.descriptor.name, "density");
  EXPECT_EQ(grid.field.background, 1.0f);
  EXPECT_EQ(grid.field.kernel, Kernel{});
  ASSERT_EQ(grid.field.ellipsoidCount(), 1u);
  const auto& chunk = grid.field.chunks[0];
  EXPECT_EQ(chunk.origin, (Coord{10, -20, 30}));
  EXPECT_EQ(chunk.ellipsoids.center[2][0], 1000.0f);
  EXPECT_EQ(chunk.ellipsoids.logScale[1][0], -1.0f);
  EXPECT_EQ(chunk.ellipsoids.rotation[2][0], -0.6f);
  EXPECT_EQ(chunk.ellipsoids.intensity[0], 0.75f);
}

TEST(GoldenFiles, AreWrittenByteForByte) {
  for (const auto& golden : goldenFiles())
    EXPECT_EQ(bytesOf(golden), contentOf(golden)) << golden.name;
}

}  // namespace
}  // namespace esvr::test
