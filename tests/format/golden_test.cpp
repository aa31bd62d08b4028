// Plan: the files in golden/ are read, and this library still writes them. A change of the format
// needs a new version.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "esvr/container.h"
#include "format/crafted_file.h"
#include "format/golden_files.h"
#include "format/sample_files.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;
using format::Codec;

const fs::path kFolder = ESVR_GOLDEN_DIR;

std::vector<std::byte> contentOf(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return test::bytesOf(std::string(std::istreambuf_iterator<char>(in), {}));
}
std::vector<std::byte> contentOf(const test::GoldenFile& golden) {
  return contentOf(kFolder / (golden.name + ".esvr"));
}

format::SectionTable tableOf(const std::vector<std::byte>& bytes) {
  return format::readTable(format::MemorySource(bytes, "golden"));
}
bool usesBlosc(const std::vector<std::byte>& bytes) {
  const auto& entries = tableOf(bytes).entries;
  return std::any_of(entries.begin(), entries.end(),
                     [](const auto& e) { return e.codec == Codec::kBlosc; });
}

TEST(GoldenFiles, AllInTheFolderAreSmallAndKnown) {
  std::vector<std::string> found, known;
  for (const auto& entry : fs::directory_iterator(kFolder)) {
    found.push_back(entry.path().filename().string());
    EXPECT_LT(entry.file_size(), 4096u) << entry.path();
  }
  for (const auto& golden : test::goldenFiles()) known.push_back(golden.name + ".esvr");
  EXPECT_THAT(found, testing::UnorderedElementsAreArray(known));
}

TEST(GoldenFiles, DecodeToTheirContent) {
  for (const auto& golden : test::goldenFiles())
    EXPECT_EQ(test::difference(decodeEsvr(contentOf(golden), golden.name), golden.content), "")
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

// The compressed bytes depend on the version of the compression library. All other bytes do not.
TEST(GoldenFiles, AreWrittenByteForByteWhereNothingIsCompressed) {
  int compared = 0;
  for (const auto& golden : test::goldenFiles()) {
    const auto bytes = contentOf(golden);
    if (usesBlosc(bytes)) continue;
    EXPECT_EQ(test::bytesOf(golden), bytes) << golden.name;
    ++compared;
  }
  EXPECT_EQ(compared, 18);
}

TEST(GoldenFiles, AreWrittenSectionForSectionWhereSomethingIsCompressed) {
  int compared = 0;
  for (const auto& golden : test::goldenFiles()) {
    const auto bytes = contentOf(golden);
    if (!usesBlosc(bytes)) continue;
    const auto old = tableOf(bytes).entries, now = tableOf(test::bytesOf(golden)).entries;
    ASSERT_EQ(old.size(), now.size()) << golden.name;
    for (std::size_t i = 0; i < old.size(); ++i) {
      EXPECT_EQ(old[i].id, now[i].id) << golden.name;
      EXPECT_EQ(old[i].flags, now[i].flags) << golden.name;
      EXPECT_EQ(old[i].rawBytes, now[i].rawBytes) << golden.name;
    }
    ++compared;
  }
  EXPECT_EQ(compared, 2);
}

}  // namespace
}  // namespace esvr
