// Plan: a fit in chunks gives the same bytes in one run and in a run that was interrupted or
// killed and continued. A folder of another run, of damaged parts, or of a running process is
// refused. A volume is converted, written back and compared by processes whose memory is limited
// to less than its voxels take. `ulimit -d` limits the heap and all private memory of a process, but
// not the files that it maps. The programs are run with so little memory that the voxels are in
// files. The tests check that the results are the same, and that a folder which cannot hold the
// files is refused by name.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/run_program.h"
#include "cli/vdb_inputs.h"
#include "esvr/vdb_io.h"
#include "esvr/workers.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

namespace fs = std::filesystem;

class Parts : public test::FolderTest {
 protected:
  void SetUp() override { test::writeInput(at("in.vdb"), {{.voxels = test::cloud(8)}}); }

  [[nodiscard]] std::vector<std::string> argumentsFor(const std::string& name,
                                                      const std::vector<std::string>& more) const {
    std::vector<std::string> all{at("in.vdb"),       at(name),     "--count",        "40",
                                 "--iterations",     "60",         "--chunk-voxels", "600",
                                 "--representation", "ellipsoids", "--device",       "cpu"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  [[nodiscard]] test::ProgramRun run(const std::string& name,
                                     const std::vector<std::string>& more = {}) const {
    return test::vdb2esvr(argumentsFor(name, more));
  }
  void expectSameBytes(const std::string& name) const {
    EXPECT_EQ(run("one.esvr").exitCode, 0);
    EXPECT_EQ(test::readText(at(name)), test::readText(at("one.esvr")));
    EXPECT_FALSE(fs::exists(at(name) + ".parts"));
  }
  /// Interrupts a run that keeps its parts.
  test::ProgramRun stopWithParts() const {
    auto stopped =
        test::runInterrupted(VDB2ESVR, argumentsFor("out.esvr", {"--resume", "--progress", "json"}),
                             "\"parts_done\":3,");
    EXPECT_EQ(stopped.exitCode, 1);
    EXPECT_FALSE(anyPart().empty());
    return stopped;
  }
  /// A result in the folder of finished parts.
  [[nodiscard]] fs::path anyPart() const {
    for (const auto& entry : fs::directory_iterator(at("out.esvr.parts")))
      if (entry.path().extension() == ".part") return entry.path();
    return {};
  }
};

TEST_F(Parts, ofAnInterruptedRunAreUsedAgain) {
  const auto stopped = stopWithParts();
  EXPECT_THAT(stopped.err, HasSubstr("the same command continues"));
  EXPECT_FALSE(fs::exists(at("out.esvr")));
  const auto resumed = run("out.esvr", {"--resume"});
  EXPECT_EQ(resumed.exitCode, 0) << resumed.err;
  expectSameBytes("out.esvr");
}

TEST_F(Parts, ofAnotherFitAreNotNamedByARunThatKeepsNone) {
  fs::create_directory(at("out.esvr.parts"));
  const auto stopped = test::runInterrupted(
      VDB2ESVR, argumentsFor("out.esvr", {"--progress", "json"}), "\"parts_done\":3,");
  EXPECT_THAT(stopped.err, AllOf(HasSubstr("interrupted"), Not(HasSubstr("out.esvr.parts"))));
}

TEST_F(Parts, areReportedAsJson) {
  std::istringstream lines(run("out.esvr", {"--progress", "json"}).err);
  int count = 0;
  double fraction = 0.0;
  for (std::string line; std::getline(lines, line); ++count) {
    const auto json = nlohmann::json::parse(line);
    EXPECT_EQ(json["grid"], "density");
    EXPECT_GE(json["fraction"], fraction);
    EXPECT_LE(json["parts_done"], json["parts"]);
    fraction = json["fraction"];
  }
  EXPECT_GT(count, 10);
  EXPECT_NEAR(fraction, 1.0, 1e-9);
}

TEST_F(Parts, thatAreDamagedAreRefused) {
  stopWithParts();
  fs::resize_file(anyPart(), 100);
  const auto resumed = run("out.esvr", {"--resume"});
  EXPECT_EQ(resumed.exitCode, 3);
  EXPECT_THAT(resumed.err, HasSubstr("is damaged; remove it"));
}

TEST_F(Parts, ofAnotherRunAreRefusedWithBothNames) {
  stopWithParts();
  const auto otherOption = run("out.esvr", {"--resume", "--seed", "5"});
  EXPECT_EQ(otherOption.exitCode, 3);
  EXPECT_THAT(otherOption.err, HasSubstr("its seed is 1, not 5"));
  fs::copy_file(at("in.vdb"), at("other.vdb"));
  auto arguments = argumentsFor("out.esvr", {"--resume"});
  arguments[0] = at("other.vdb");
  const auto otherInput = test::vdb2esvr(arguments);
  EXPECT_EQ(otherInput.exitCode, 3);
  EXPECT_THAT(otherInput.err, AllOf(HasSubstr("in.vdb, not "), HasSubstr("other.vdb")));
}

TEST_F(Parts, areNotUsedByTwoRunsAtATime) {
  const PartStore store(at("out.esvr.parts"), {}, PartStore::Access::kAlone);
  const auto second = run("out.esvr", {"--resume"});
  EXPECT_EQ(second.exitCode, 1);
  EXPECT_THAT(second.err, HasSubstr("another process uses"));
}

TEST_F(Parts, cannotBeKeptOnAFullDisk) {
  std::string command = VDB2ESVR;
  for (const auto& argument : argumentsFor("out.esvr", {"--resume"})) command += ' ' + argument;
  const auto full = test::runOnFullDisk(command);
  EXPECT_EQ(full.exitCode, 1);
  EXPECT_THAT(full.err, AllOf(HasSubstr("out.esvr.parts/"), HasSubstr("File too large")));
  EXPECT_EQ(run("out.esvr", {"--resume"}).exitCode, 0);
  expectSameBytes("out.esvr");
}

TEST_F(Parts, keepFilesOfOthersInTheirFolder) {
  fs::create_directory(at("out.esvr.parts"));
  test::writeText(at("out.esvr.parts/notes.txt"), "mine");
  EXPECT_EQ(run("out.esvr", {"--resume"}).exitCode, 0);
  EXPECT_EQ(test::readText(at("out.esvr.parts/notes.txt")), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(at("out.esvr.parts")), {}), 1);
}

TEST_F(Parts, followNoLinkInTheirFolder) {
  test::writeText(at("precious"), "mine");
  for (const char* name : {"lock", "origin"}) {
    fs::remove_all(at("out.esvr.parts"));
    fs::create_directory(at("out.esvr.parts"));
    fs::create_symlink(at("precious"), at("out.esvr.parts/") + name);
    const auto refused = run("out.esvr", {"--resume"});
    EXPECT_EQ(refused.exitCode, 1);
    EXPECT_THAT(refused.err, HasSubstr("not a regular file"));
    EXPECT_EQ(test::readText(at("precious")), "mine");
  }
}

constexpr std::int32_t kSide = 48;        // bricks; the voxels take 226 MB
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

TEST(OutOfCore, SlowVolumeLargerThanTheMemoryGoesThereAndBack) {
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

/// Enough for a small volume without its voxels.
constexpr const char* kLittle = "40KB";

class Scratch : public test::Vdb2Esvr {
 protected:
  using Arguments = std::vector<std::string>;

  [[nodiscard]] Arguments withLittle(Arguments more, const std::string& scratch) const {
    more.insert(more.end(), {"--max-memory", kLittle, "--scratch", scratch});
    return more;
  }
  [[nodiscard]] test::ProgramRun fitWithLittle(const std::string& output,
                                               const std::string& scratch,
                                               const Arguments& more = {}) const {
    return test::quickFit(in(), output, withLittle(more, scratch));
  }
  [[nodiscard]] std::string here() const { return folder_.path().string(); }
};

TEST_F(Scratch, HoldsVoxelsAndChangesNoBit) {
  for (const Arguments& form : {Arguments{}, {"--storage", "float32"}}) {
    const std::string little = folder_ / "little.esvr";
    ASSERT_EQ(test::quickFit(in(), out(), form).exitCode, 0);
    const auto run = fitWithLittle(little, here(), form);
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(test::readText(little), test::readText(out()));
    std::filesystem::remove(little);
    std::filesystem::remove(out());
  }
}

TEST_F(Scratch, HoldsVoxelsOfLosslessFilesOnTheWayThereAndBack) {
  const Arguments there{in(), out(), "--lossless"}, back{out(), folder_ / "back.vdb"},
      check{"check", in(), folder_ / "back.vdb", "--max-error", "0", "--fail-on", "all"};
  const auto converted = test::vdb2esvr(withLittle(there, here()));
  ASSERT_EQ(converted.exitCode, 0) << converted.err;
  const auto restored = test::esvr2vdb(withLittle(back, here()));
  ASSERT_EQ(restored.exitCode, 0) << restored.err;
  const auto checked = test::runProgram(ESVR_COMPARE, withLittle(check, here()));
  EXPECT_EQ(checked.exitCode, 0) << checked.out << checked.err;
}

// No file can be made in /proc, for root either.
TEST_F(Scratch, WithoutRoomIsAnErrorThatNamesTheFolder) {
  const auto run = fitWithLittle(out(), "/proc");
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_THAT(run.err, HasSubstr("of files in /proc, which has 0 MB free"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Scratch, IsAFolderThatExistsInEveryProgram) {
  const std::string missing = folder_ / "missing";
  ASSERT_EQ(fitQuickly().exitCode, 0);
  const std::vector<std::pair<const char*, Arguments>> runs{
      {VDB2ESVR, {in(), folder_ / "a.esvr"}},
      {ESVR2VDB, {out(), folder_ / "a.vdb"}},
      {ESVR_RENDER, {out(), folder_ / "a.png"}},
      {ESVR_COMPARE, {"check", in(), out()}},
      {ESVR_COMPARE, {"table", in(), out()}},
      {ESVR_COMPARE, {"curves", in(), out(), "-o", folder_ / "c"}}};
  for (auto [program, arguments] : runs) {
    arguments.insert(arguments.end(), {"--scratch", missing});
    const auto run = test::runProgram(program, arguments);
    EXPECT_EQ(run.exitCode, 2) << program << run.out;
    EXPECT_THAT(run.err, AllOf(HasSubstr("--scratch"), HasSubstr(missing))) << program;
  }
}

}  // namespace
}  // namespace esvr
