// Plan: a volume is converted, written back and compared by processes whose memory is limited to a
// third of its voxels. `ulimit -d` limits the heap and all private memory of a process, but not the
// files that it maps.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cli/converters.h"
#include "esvr/vdb_io.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

constexpr std::int32_t kSide = 66;        // bricks; the voxels take 589 MB
constexpr const char* kLimit = "190000";  // KB
constexpr const char* kMaxMemory = "100MB";

/// A dense volume with a smooth field, in which no brick is constant.
VolumeGrid denseGrid() {
  VolumeGrid grid;
  grid.descriptor.name = "density";
  grid.descriptor.transform = uniformTransform(1.0);
  SparseVolume& volume = grid.volume;
  for (std::int32_t x = 0; x < kSide; ++x)
    for (std::int32_t y = 0; y < kSide; ++y)
      for (std::int32_t z = 0; z < kSide; ++z) volume.bricks.push_back({x, y, z});
  volume.active.resize(volume.brickCount());
  for (auto& mask : volume.active) mask.setAll();
  volume.values.resize(volume.brickCount() * kBrickVoxels);
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    volume.values[i] = 0.125f + float(i % kBrickVoxels / 64) / 8.0f;
  return grid;
}

test::ProgramRun limited(const std::string& program, const std::vector<std::string>& arguments) {
  std::string line = "ulimit -d " + std::string(kLimit) + "; exec " + program;
  for (const auto& argument : arguments) line += " '" + argument + "'";
  return test::runProgram("/bin/sh", {"-c", line});
}

TEST(OutOfCore, SlowVolumeOfThreeTimesTheMemoryGoesThereAndBack) {
  const test::TemporaryFolder folder;
  const std::string in = folder / "in.vdb", file = folder / "out.esvr", back = folder / "back.vdb";
  writeGrids(in, {}, std::vector{denseGrid()}, {.constantTiles = false});
  const std::vector<std::string> memory{"--max-memory", kMaxMemory, "--scratch",
                                        folder.path().string()};
  const auto run = [&](const std::string& program, std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), memory.begin(), memory.end());
    const auto ended = limited(program, arguments);
    EXPECT_EQ(ended.exitCode, 0) << program << ended.out << ended.err;
  };
  run(VDB2ESVR, {in, file, "--count", "300", "--iterations", "1", "--storage", "float32",
                 "--device", "cpu", "--threads", "2", "-q"});
  run(ESVR2VDB, {file, back, "--threads", "2"});
  run(ESVR_COMPARE, {"check", in, back, "--min-psnr", "1", "--threads", "2"});
}

}  // namespace
}  // namespace esvr
