#include "esvr/volume.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <numeric>
#include <string>
#include <thread>

#include "../support/temporary_folder.h"
#include "esvr/error.h"

namespace esvr {
namespace {

constexpr std::size_t kMega = std::size_t{1} << 20;

/// Arrays of more than 1 KB are in files, and as little as possible of them is in memory.
VoxelMemory filesIn(const std::filesystem::path& folder) {
  return VoxelMemory({.folder = folder, .maxHeapBytes = 1024, .maxResidentBytes = 0});
}

std::uint64_t residentFileBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (std::uint64_t kilobytes = 0; word == "RssFile:" && status >> kilobytes)
      return kilobytes * 1024;
  return 0;
}

TEST(VoxelMemory, IsTheHeapByDefault) {
  EXPECT_FALSE(VoxelMemory().isInFile(std::uint64_t{1} << 60));
  const VoxelArray<float> array(100, 2.0f);
  EXPECT_EQ(array.back(), 2.0f);
}

TEST(VoxelMemory, IsAFileAboveTheLimitOnly) {
  const test::TemporaryFolder folder;
  const VoxelMemory memory = filesIn(folder.path());
  EXPECT_FALSE(memory.isInFile(1024));
  EXPECT_TRUE(memory.isInFile(1025));
}

TEST(VoxelMemory, OfAFileHoldsWhatIsWrittenAndGrows) {
  const test::TemporaryFolder folder;
  VoxelArray<int> array(filesIn(folder.path()));
  for (int i = 0; i < 100'000; ++i) array.push_back(i);
  std::vector<int> expected(array.size());
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_TRUE(std::equal(array.begin(), array.end(), expected.begin(), expected.end()));
  EXPECT_TRUE(folder.names().empty()) << "the files have no names";
}

TEST(VoxelMemory, OfACopyIsThatOfTheOriginal) {
  const test::TemporaryFolder folder;
  const VoxelArray<float> original(5000, 1.0f, filesIn(folder.path()));
  VoxelArray<float> copy = original, assigned;
  assigned = original;
  copy[7] = 2.0f;
  EXPECT_EQ(original[7], 1.0f);
  EXPECT_EQ(assigned, original);
  for (const auto& array : {copy, assigned})
    EXPECT_EQ(array.get_allocator().memory(), original.get_allocator().memory());
}

// The array keeps its content while a thread gives back its memory again and again.
TEST(VoxelMemory, GivesBackWhatExceedsTheLimit) {
  const test::TemporaryFolder folder;
  const std::uint64_t before = residentFileBytes();
  VoxelArray<std::uint64_t> array(64 * kMega / sizeof(std::uint64_t), filesIn(folder.path()));
  std::iota(array.begin(), array.end(), std::uint64_t{0});
  const auto isGivenBack = [&] { return residentFileBytes() < before + 8 * kMega; };
  for (int tries = 0; tries < 1000 && !isGivenBack(); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(isGivenBack());
  for (std::size_t i = 0; i < array.size(); ++i) ASSERT_EQ(array[i], i);
}

TEST(VoxelMemory, RefusesAFolderThatIsNotThere) {
  const test::TemporaryFolder folder;
  const VoxelMemory memory = filesIn(folder / "missing");
  try {
    const VoxelArray<float> array(1000, memory);
    FAIL() << "no error";
  } catch (const RuntimeFailure& error) {
    EXPECT_NE(std::string(error.what()).find((folder / "missing").string()), std::string::npos);
  }
}

// A write to a file without room would end the process with SIGBUS.
TEST(VoxelMemory, RefusesAFullDiskBeforeAnythingIsWritten) {
  const test::TemporaryFolder folder;
  const VoxelMemory memory = filesIn(folder.path());
  const std::size_t beyondAnyDisk = std::size_t{1} << 58;
  EXPECT_THROW((void)memory.allocate(beyondAnyDisk), RuntimeFailure);
}

}  // namespace
}  // namespace esvr
