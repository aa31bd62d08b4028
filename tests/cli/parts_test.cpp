// Plan: a fit in chunks gives the same bytes in one run and in a run that was interrupted or killed and
// continued. Results are the same where voxels are in files: `ulimit -d` limits the heap and all
// private memory of a process, but not the files that it maps.

#include <iterator>

#include "cli/conversion.h"
#include "esvr/workers.h"
#include "fit/volumes.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;
using testing::Not;

namespace fs = std::filesystem;

class Parts : public FolderTest {
 protected:
  void SetUp() override { writeInput(at("in.vdb"), {{.voxels = cloud(8)}}); }

  [[nodiscard]] Words argumentsFor(const std::string& name, const Words& more) const {
    return joined({at("in.vdb"), at(name), "--count", "40", "--iterations", "60", "--chunk-voxels",
                   "600", "--representation", "ellipsoids", "--device", "cpu"},
                  more);
  }
  [[nodiscard]] ProgramRun run(const std::string& name, const Words& more = {}) const {
    return vdb2esvr(argumentsFor(name, more));
  }
  void expectSameBytes(const std::string& name) const {
    succeeded(run("one.esvr"));
    EXPECT_EQ(readText(at(name)), readText(at("one.esvr")));
    EXPECT_FALSE(fs::exists(at(name) + ".parts"));
  }
  /// Interrupts a run that keeps its parts.
  ProgramRun stopWithParts() const {
    auto stopped = runInterrupted(VDB2ESVR, argumentsFor("out.esvr", "--resume --progress json"),
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
  EXPECT_THAT(stopWithParts().err, HasSubstr("the same command continues"));
  EXPECT_FALSE(fs::exists(at("out.esvr")));
  succeeded(run("out.esvr", "--resume"));
  expectSameBytes("out.esvr");
}

TEST_F(Parts, ofAnotherFitAreNotNamedByARunThatKeepsNone) {
  fs::create_directory(at("out.esvr.parts"));
  EXPECT_THAT(
      runInterrupted(VDB2ESVR, argumentsFor("out.esvr", "--progress json"), "\"parts_done\":3,")
          .err,
      Says("interrupted", Not(HasSubstr("out.esvr.parts"))));
}

TEST_F(Parts, areReportedAsJson) {
  std::istringstream lines(run("out.esvr", "--progress json").err);
  int count = 0;
  double fraction = 0.0;
  for (std::string line; std::getline(lines, line); ++count) {
    const auto json = Json::parse(line);
    EXPECT_EQ(json["grid"], "density");
    EXPECT_GE(json["fraction"], fraction);
    EXPECT_LE(json["parts_done"], json["parts"]);
    fraction = json["fraction"];
  }
  EXPECT_GT(count, 10);
  EXPECT_NEAR(fraction, 1.0, 1e-9);
}

TEST_F(Parts, ofAnotherRunAreRefusedWithBothNames) {
  stopWithParts();
  EXPECT_THAT(run("out.esvr", "--resume --seed 5"), Fails(3, "its seed is 1, not 5"));
  fs::copy_file(at("in.vdb"), at("other.vdb"));
  auto arguments = argumentsFor("out.esvr", "--resume");
  arguments[0] = at("other.vdb");
  EXPECT_THAT(vdb2esvr(arguments), Fails(3, "in.vdb, not ", "other.vdb"));
}

TEST_F(Parts, areNotUsedByTwoRunsAtATime) {
  const PartStore store(at("out.esvr.parts"), {}, PartStore::Access::kAlone);
  EXPECT_THAT(run("out.esvr", "--resume"), Fails(1, "another process uses"));
}

// The shell limits files to 512 bytes, which has the effect of a full disk. A message on stderr still fits.
TEST_F(Parts, cannotBeKeptOnAFullDisk) {
  std::string command = std::string("ulimit -f 1; exec ") + VDB2ESVR;
  for (const auto& argument : argumentsFor("out.esvr", "--resume")) command += ' ' + argument;
  EXPECT_THAT(runShell(command), Fails(1, "out.esvr.parts/", "File too large"));
  succeeded(run("out.esvr", "--resume"));
  expectSameBytes("out.esvr");
}

TEST_F(Parts, keepFilesOfOthersInTheirFolder) {
  fs::create_directory(at("out.esvr.parts"));
  writeText(at("out.esvr.parts/notes.txt"), "mine");
  succeeded(run("out.esvr", "--resume"));
  EXPECT_EQ(readText(at("out.esvr.parts/notes.txt")), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(at("out.esvr.parts")), {}), 1);
}

TEST_F(Parts, followNoLinkInTheirFolder) {
  writeText(at("precious"), "mine");
  for (const char* name : {"lock", "origin"}) {
    fs::remove_all(at("out.esvr.parts"));
    fs::create_directory(at("out.esvr.parts"));
    fs::create_symlink(at("precious"), at("out.esvr.parts/") + name);
    EXPECT_THAT(run("out.esvr", "--resume"), Fails(1, "not a regular file"));
    EXPECT_EQ(readText(at("precious")), "mine");
  }
}

constexpr std::int32_t kSide = 32;  // bricks; the voxels take 67 MB
constexpr const char* kMaxMemory = "25MB";

/// A program, and KB between what it needs with voxels in files and what it would need with voxels on the heap.
struct LimitedProgram {
  std::string path;
  std::string limit;
};
const LimitedProgram kFits{VDB2ESVR, "150000"};          // 130000, and more than 170000
const LimitedProgram kConvertsBack{ESVR2VDB, "100000"};  // 75000
const LimitedProgram kCompares{ESVR_COMPARE, "100000"};  // 75000, and more than 125000

/// A dense volume with a smooth field, in which no brick is constant.
VolumeGrid denseGrid() {
  VolumeGrid grid;
  grid.descriptor.name = "density";
  grid.descriptor.transform = uniformTransform(1.0);
  SparseVolume& volume = grid.volume;
  volume.bricks = cubeOfBricks(kSide);
  volume.active.resize(volume.brickCount());
  for (auto& mask : volume.active) mask.setAll();
  volume.values.resize(volume.brickCount() * kBrickVoxels);
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    volume.values[i] = 0.125f + float(i % kBrickVoxels / 64) / 8.0f;
  return grid;
}

ProgramRun limited(const LimitedProgram& program, const Words& arguments) {
  std::string line = "ulimit -d " + program.limit + "; exec " + program.path;
  for (const auto& argument : arguments) line += " '" + argument + "'";
  return runShell(line);
}

TEST(OutOfCore, SlowVolumeLargerThanTheMemoryGoesThereAndBack) {
  const TemporaryFolder folder;
  const std::string in = folder / "in.vdb", file = folder / "out.esvr", back = folder / "back.vdb";
  writeGrids(in, {}, std::vector{denseGrid()}, {.constantTiles = false});
  const Words memory{"--max-memory", kMaxMemory, "--scratch", folder.path().string()};
  const auto run = [&](const LimitedProgram& program, const Words& arguments) {
    const auto ended = limited(program, joined(arguments, memory));
    EXPECT_EQ(ended.exitCode, 0) << program.path << ended.out << ended.err;
  };
  const auto needsFiles = [](const LimitedProgram& program, const Words& arguments) {
    EXPECT_NE(limited(program, arguments).exitCode, 0) << program.path << ": the limit is too high";
  };
  const Words there =
      joined({in, file}, "--count 10 --iterations 1 --storage float32 --device cpu --threads 2 -q");
  const Words check{"check", in, back, "--min-psnr", "1", "--threads", "2"};
  needsFiles(kFits, there);
  run(kFits, there);
  run(kConvertsBack, {file, back, "--threads", "2"});
  needsFiles(kCompares, check);
  run(kCompares, check);
}

/// Enough for a small volume without its voxels.
constexpr const char* kLittle = "40KB";

class Scratch : public Vdb2Esvr {
 protected:
  using Arguments = Words;

  [[nodiscard]] Arguments withLittle(Arguments more, const std::string& scratch) const {
    return joined(more, {"--max-memory", kLittle, "--scratch", scratch});
  }
  [[nodiscard]] ProgramRun fitWithLittle(const std::string& output, const std::string& scratch,
                                         const Arguments& more = {}) const {
    return quickFit(in(), output, withLittle(more, scratch));
  }
  [[nodiscard]] std::string here() const { return folder_.path().string(); }
};

TEST_F(Scratch, HoldsVoxelsAndChangesNoBit) {
  for (const Arguments& form : {Arguments{}, {"--storage", "float32"}}) {
    const std::string little = folder_ / "little.esvr";
    succeeded(quickFit(in(), out(), form));
    succeeded(fitWithLittle(little, here(), form));
    EXPECT_EQ(readText(little), readText(out()));
    std::filesystem::remove(little);
    std::filesystem::remove(out());
  }
}

TEST_F(Scratch, HoldsVoxelsOfLosslessFilesOnTheWayThereAndBack) {
  const Arguments there{in(), out(), "--lossless"}, back{out(), folder_ / "back.vdb"},
      check{"check", in(), folder_ / "back.vdb", "--max-error", "0", "--fail-on", "all"};
  succeeded(vdb2esvr(withLittle(there, here())));
  succeeded(esvr2vdb(withLittle(back, here())));
  succeeded(runProgram(ESVR_COMPARE, withLittle(check, here())));
}

// No file can be made in /proc, for root either.
TEST_F(Scratch, WithoutRoomIsAnErrorThatNamesTheFolder) {
  EXPECT_THAT(fitWithLittle(out(), "/proc"), Fails(5, "of files in /proc, which has 0 MB free"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Scratch, IsAFolderThatExistsInEveryProgram) {
  const std::string missing = folder_ / "missing";
  succeeded(fitQuickly());
  const std::vector<std::pair<const char*, Arguments>> runs{
      {VDB2ESVR, {in(), folder_ / "a.esvr"}},
      {ESVR2VDB, {out(), folder_ / "a.vdb"}},
      {ESVR_RENDER, {out(), folder_ / "a.png"}},
      {ESVR_COMPARE, {"check", in(), out()}},
      {ESVR_COMPARE, {"table", in(), out()}}};
  for (auto [program, arguments] : runs) {
    const auto run = runProgram(program, joined(arguments, {"--scratch", missing}));
    EXPECT_EQ(run.exitCode, 2) << program << run.out;
    EXPECT_THAT(run.err, Says("--scratch", missing)) << program;
  }
}

}  // namespace
}  // namespace esvr::test
