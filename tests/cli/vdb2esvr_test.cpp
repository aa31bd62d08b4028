// Plan: vdb2esvr is run as a separate process with one small grid. The tests check what it prints,
// and that the file has the size, the error or the voxels of the goal, on any number of threads.
// vdb2esvr is run where its output cannot or must not be written, and is interrupted. The tests
// check the files that are there afterwards. vdb2esvr is run on files that it cannot read, on
// grids that it cannot convert, and on several grids. The tests check exit codes and messages, and
// that refused input leaves no file behind. vdb2esvr is run with options that are wrong or exclude
// each other. The tests check the exit code, that the message names the option, and that no file
// is written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "cli/converters.h"
#include "cli/run_program.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "field/random_field.h"
#include "support/non_finite.h"

namespace esvr {
namespace {

using test::InputGrid;
using test::kInf;
using test::kNan;
using test::quickFit;
using test::Refusal;
using test::softBall;
using test::Vdb2Esvr;
using test::vdb2esvr;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

using Json = nlohmann::json;

TEST_F(Vdb2Esvr, printsATableAndWritesTheFile) {
  const auto run = fitQuickly();
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("PSNR box"), HasSubstr("PSNR T 0.5"), HasSubstr("density"),
                             HasSubstr("bytes, 1 :")));
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "out.esvr"));
}

TEST_F(Vdb2Esvr, saysWhereExactVoxelsWouldTakeFewerBytes) {
  test::writeInput(in(), {{.voxels = test::cloud(8)}});
  const auto summaryOf = [&](const char* count) {
    return vdb2esvr({in(), out(), "--force", "--iterations", "5", "--count", count, "--storage",
                     "float32"})
        .out;
  };
  EXPECT_THAT(summaryOf("10"), Not(HasSubstr("exact voxels")));
  EXPECT_THAT(summaryOf("5000"), HasSubstr("exact voxels would take fewer bytes, about "));
}

TEST_F(Vdb2Esvr, listsTheKeysOfThePapersMethod) {
  const auto run = vdb2esvr({"--help", "paper"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("epochs (=2800)"), HasSubstr("prune-score (=full)")));
}

TEST_F(Vdb2Esvr, endsWithCodeFourWhereThePsnrIsMissedAndWritesTheFile) {
  const auto run = fitQuickly({"--psnr", "200"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, AllOf(HasSubstr("instead of 200.00 dB"), HasSubstr("was written")));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

TEST_F(Vdb2Esvr, keepsToTheSizeAskedFor) {
  const auto run = vdb2esvr(
      {in(), out(), "--size", "1.5KB", "--iterations", "60", "--representation", "ellipsoids"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LE(std::filesystem::file_size(out()), 1500u);
  EXPECT_GE(std::filesystem::file_size(out()), 1470u);
}

TEST_F(Vdb2Esvr, losslessGivesBackEveryBit) {
  const auto run = vdb2esvr({in(), out(), "--lossless"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const SparseVolume source = readGrid(in(), "density", {}).volume;
  const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
  EXPECT_EQ(back.values, source.values);
  EXPECT_EQ(back.active, source.active);
}

TEST_F(Vdb2Esvr, keepsEveryVoxelWithinTheBound) {
  const auto run = vdb2esvr({in(), out(), "--max-error", "1%", "--topology", "exact"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const SparseVolume source = readGrid(in(), "density", {}).volume;
  const ValueRange range = activeRange(source);
  const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
  EXPECT_LE(compareVolumes(source, back).maxError, 0.01 * (double(range.max) - range.min));
  EXPECT_EQ(back.active, source.active);
}

TEST_F(Vdb2Esvr, storesTheMaskWhereAsked) {
  ASSERT_EQ(fitQuickly({"--topology", "exact"}).exitCode, 0);
  const SparseVolume source = readGrid(in(), "density").volume;
  const StoredGrid grid = readEsvr(out()).grids[0];
  EXPECT_GT(grid.field.ellipsoidCount(), 0u);
  const SparseVolume back = decodeGrid(grid);
  EXPECT_EQ(back.bricks, source.bricks);
  EXPECT_EQ(back.active, source.active);
}

/// A ball in a cloud with a rough boundary, which is fainter than the error.
std::vector<test::InputVoxel> ballInACloud() {
  std::vector<test::InputVoxel> voxels;
  for (Coord v; v.x < 40; ++v.x)
    for (v.y = 0; v.y < 40; ++v.y)
      for (v.z = 0; v.z < 40; ++v.z) {
        const double r = std::hypot(v.x - 20.0, v.y - 20.0, v.z - 20.0);
        if (r < 6.0)
          voxels.push_back({v, float(7.0 - r)});
        else if (r < 16.0 + std::sin(2.0 * v.x) + std::sin(3.0 * v.y + v.z))
          voxels.push_back({v, 1e-4f});
      }
  return voxels;
}

TEST_F(Vdb2Esvr, saysWhatAMaskTakes) {
  test::writeInput(in(), {{.voxels = ballInACloud()}});
  const std::string report = folder_ / "report.json";
  const auto run = fitQuickly({"--report", report, "--topology", "exact"});
  EXPECT_THAT(run.out, HasSubstr("density: the mask of active voxels takes "));
  const Json topology = Json::parse(test::readText(report))["grids"][0]["topology"];
  EXPECT_EQ(topology["kind"], "mask");
  EXPECT_GT(topology["mask_bytes"].get<int>(), 0);
  EXPECT_TRUE(topology["threshold"].is_null());
}

TEST_F(Vdb2Esvr, givesUpVoxelsOfTheMaskButNotTheirBox) {
  test::writeInput(in(), {{.voxels = ballInACloud()}});
  const SparseVolume source = readGrid(in(), "density").volume;
  for (const char* representation : {"ellipsoids", "voxels"}) {
    const auto run =
        vdb2esvr({in(), out(), "--force", "--psnr", "40", "--representation", representation});
    EXPECT_THAT(run.out, Not(HasSubstr("mask"))) << run.err;
    const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
    EXPECT_EQ(activeBox(back), activeBox(source));
    EXPECT_LT(2 * activeVoxelCount(back), activeVoxelCount(source));
    EXPECT_GE(compareVolumes(source, back).psnrBox, 40.0);
  }
}

TEST_F(Vdb2Esvr, givesTheSameBytesInEveryRunOnAnyNumberOfThreads) {
  const std::string other = folder_ / "other.esvr";
  ASSERT_EQ(fitQuickly({"--threads", "1"}).exitCode, 0);
  for (const char* threads : {"1", "3"}) {
    ASSERT_EQ(quickFit(in(), other, {"--threads", threads, "--force"}).exitCode, 0);
    EXPECT_EQ(test::readText(other), test::readText(out())) << threads << " threads";
  }
}

TEST_F(Vdb2Esvr, storesVoxelsForABound) {
  const std::string report = folder_ / "r.json";
  const auto run = vdb2esvr({in(), out(), "--max-error", "5%", "--report", report});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Json made = Json::parse(test::readText(report))["grids"][0]["representation"];
  EXPECT_EQ(made["stored"], "voxels");
  EXPECT_TRUE(made["ellipsoids"].is_null());
  EXPECT_TRUE(readEsvr(out()).grids[0].voxels.has_value());
  const auto refused =
      vdb2esvr({in(), out(), "--force", "--max-error", "5%", "--representation", "ellipsoids"});
  EXPECT_EQ(refused.exitCode, 2);
  EXPECT_THAT(refused.err, HasSubstr("store voxels"));
}

TEST_F(Vdb2Esvr, keepsAnExistingFileUnlessForced) {
  test::writeText(out(), "precious");
  const auto refused = fitQuickly();
  EXPECT_EQ(refused.exitCode, 1);
  EXPECT_THAT(refused.err, HasSubstr("--force"));
  EXPECT_EQ(test::readText(out()), "precious");
  EXPECT_EQ(fitQuickly({"--force"}).exitCode, 0);
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

TEST_F(Vdb2Esvr, refusesOutputsThatCannotBeWrittenBeforeAnyWork) {
  std::filesystem::create_directory(folder_ / "folder.esvr");
  for (const std::string name : {"none/out.esvr", "folder.esvr"}) {
    const auto run = quickFit(in(), folder_ / name, {"--force"});
    EXPECT_EQ(run.exitCode, 1) << name;
    EXPECT_THAT(run.err, HasSubstr(name));
  }
  EXPECT_THAT(quickFit(in(), "/proc/out.esvr").err, HasSubstr("/proc/out.esvr"));
  const auto wrongEnding = quickFit(in(), folder_ / "out.vdb");
  EXPECT_EQ(wrongEnding.exitCode, 2);
  EXPECT_THAT(wrongEnding.err, HasSubstr(".esvr"));
  EXPECT_THAT(folder_.names(), ElementsAre("folder.esvr", "in.vdb"));
}

TEST_F(Vdb2Esvr, refusesToWriteOverItsInput) {
  std::filesystem::create_hard_link(in(), out());
  const auto run = fitQuickly({"--force"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("one file"));
}

TEST_F(Vdb2Esvr, leavesNothingOnAFullDisk) {
  test::writeText(folder_ / "old.esvr", "precious");
  for (const std::string name : {"out.esvr", "old.esvr"}) {
    const auto run = test::runOnFullDisk(std::string(VDB2ESVR) + " " + in() + " " +
                                         (folder_ / name).string() + " --force --iterations 10");
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_THAT(run.err, AllOf(HasSubstr(name), HasSubstr("File too large")));
  }
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "old.esvr"));
  EXPECT_EQ(test::readText(folder_ / "old.esvr"), "precious");
}

TEST_F(Vdb2Esvr, keepsTheFileWhereOnlyTheTableCannotBePrinted) {
  const auto run = test::runProgram(
      "/bin/sh", {"-c", std::string(VDB2ESVR) + " " + in() + " " + out() +
                            " --iterations 10 --representation ellipsoids > /dev/full"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("standard output"));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

/// A fit of a minute, which is interrupted after its first message about progress.
class Interrupted : public Vdb2Esvr {
 protected:
  [[nodiscard]] test::ProgramRun interrupted() const {
    test::writeInput(in(), {{.voxels = softBall({})},
                            {.name = "heat", .voxels = softBall({}, 2.0f)},
                            {.name = "copy", .voxels = softBall({})}});
    return test::runInterrupted(
        VDB2ESVR, {in(), out(), "--seconds", "60", "--representation", "ellipsoids", "-v"},
        " left\n");
  }
};

TEST_F(Interrupted, writesTheBestSoFarAndEndsWithCodeOne) {
  const auto run = interrupted();
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("out.esvr has the best result so far, without grid \"heat\""));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "out.esvr"));
}

TEST_F(Vdb2Esvr, SlowEndsWithinTwoSecondsOfASignal) {
  // A million active voxels, for which a search for a size takes many seconds.
  const std::string large = folder_ / "large.vdb";
  ASSERT_EQ(test::runProgram(ESVR_SAMPLE, {"plume", large, "--resolution", "256"}).exitCode, 0);
  for (const int signal : {SIGINT, SIGTERM})
    for (const double after : {0.3, 1.0, 2.0, 4.0}) {
      test::RunningProgram program(VDB2ESVR,
                                   {large, out(), "--force", "--size", "60KB", "--device", "cpu"});
      std::this_thread::sleep_for(std::chrono::duration<double>(after));
      ASSERT_TRUE(program.runs());
      const auto start = std::chrono::steady_clock::now();
      program.send(signal);
      const auto run = program.wait();
      const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
      std::cout << "signal " << signal << " after " << after << " s: " << seconds.count() << " s, "
                << run.err;
      EXPECT_LT(seconds.count(), 2.0);
      EXPECT_EQ(run.exitCode, 1);
      EXPECT_THAT(run.err, HasSubstr("interrupted"));
      if (!std::filesystem::exists(out())) continue;
      EXPECT_THAT(checkEsvr(out()), IsEmpty());
      EXPECT_LE(std::filesystem::file_size(out()), 60'000u);
      std::filesystem::remove(out());
    }
}

struct BadFile {
  const char* name;
  std::function<void(const std::string& path)> make;
  const char* words;
};
std::ostream& operator<<(std::ostream& out, const BadFile& file) { return out << file.name; }

class BadInputFile : public testing::TestWithParam<BadFile> {};

TEST_P(BadInputFile, isRefusedByNameWithCodeThreeAndNothingIsWritten) {
  const test::TemporaryFolder folder;
  const std::string in = folder / "in.vdb";
  GetParam().make(in);
  const auto run = quickFit(in, folder / "out.esvr");
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("in.vdb"), HasSubstr(GetParam().words)));
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(folder.names(), Not(testing::Contains(HasSubstr("esvr"))));
}

/// A grid with voxels that are not finite. The first of them in index order is (1, 2, 3).
InputGrid withNonFinite() {
  InputGrid grid{.voxels = softBall({})};
  grid.voxels.push_back({{9, 9, 9}, kInf});
  grid.voxels.push_back({{1, 2, 3}, kNan});
  return grid;
}

void truncated(const std::string& path) {
  test::writeInput(path, {{.voxels = softBall({})}});
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadInputFile,
    testing::Values(
        BadFile{"missing", [](const std::string&) {}, "no such file"},
        BadFile{"directory", [](const auto& path) { std::filesystem::create_directory(path); },
                "is a directory"},
        BadFile{"empty", [](const auto& path) { test::writeText(path, ""); }, "is empty"},
        BadFile{"text", [](const auto& path) { test::writeText(path, "density 1 2 3\n"); },
                "neither an OpenVDB nor a NanoVDB"},
        BadFile{"truncated", truncated, "in.vdb"},
        BadFile{"not finite", [](const auto& path) { test::writeInput(path, {withNonFinite()}); },
                "2 voxels are NaN, infinite or too large for float; the first is at (1, 2, 3)"}));

TEST_F(Vdb2Esvr, listsTheGridsWhereTheOneAskedForIsNotThere) {
  test::writeInput(in(), {{.name = "a", .voxels = softBall({})}, {.name = "b"}});
  const auto run = fitQuickly({"-g", "c"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("no grid \"c\""), HasSubstr("\"a\""), HasSubstr("\"b\"")));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Vdb2Esvr, carriesGridsOfOtherTypesAndEmptyOnes) {
  test::writeMixedInput(in(), {{.voxels = softBall({})}, {.name = "none"}});
  const auto run = fitQuickly();
  EXPECT_EQ(run.exitCode, 0);
  for (const char* type : {"bool", "int32", "vec3s", "ptdataidx32", "no active voxel"})
    EXPECT_THAT(run.out, HasSubstr(type));
  const EsvrFile file = readEsvr(out());
  EXPECT_EQ(file.grids.size(), 1u);
  EXPECT_EQ(file.carried.size(), 5u);
}

TEST_F(Vdb2Esvr, takesNonFiniteVoxelsAsZeroWhereAskedAndSaysHowMany) {
  test::writeInput(in(), {withNonFinite()});
  const auto run = fitQuickly({"--nonfinite", "zero"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("NaN or infinite voxels were replaced by 0 (2 voxels)"));
  EXPECT_TRUE(outIsThere());
}

TEST_F(Vdb2Esvr, replacesNonFiniteVoxelsByTheBackgroundOrByAValue) {
  test::writeInput(in(), {withNonFinite()});
  for (const auto& [option, words] :
       {std::pair{"background", "replaced by the background (2 voxels)"},
        std::pair{"0.25", "replaced by 0.25 (2 voxels)"}}) {
    const auto run = test::vdb2esvr({in(), out(), "--force", "--lossless", "--nonfinite", option});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_THAT(run.err, HasSubstr(words));
  }
  const SparseVolume decoded = decodeGrid(readEsvr(out()).grids.front());
  EXPECT_EQ(valueAt(decoded, {1, 2, 3}), 0.25f);
  std::filesystem::remove(out());
  EXPECT_EQ(fitQuickly({"--nonfinite", "error"}).exitCode, 3);
  for (const char* wrong : {"kept", "nan", "1e99", ""})
    EXPECT_EQ(fitQuickly({"--nonfinite", wrong}).exitCode, 2) << wrong;
}

TEST_F(Vdb2Esvr, fitsTheGridsThatAreNamedOnly) {
  test::writeInput(in(), {{.voxels = softBall({})},
                          {.voxels = softBall({30, 0, 0})},
                          {.name = "heat", .voxels = softBall({})}});
  ASSERT_EQ(fitQuickly({"-g", "heat", "-g", "density[1]"}).exitCode, 0);
  const EsvrFile file = readEsvr(out());
  ASSERT_EQ(file.grids.size(), 2u);
  EXPECT_EQ(file.grids[0].activeBox.min.x, 26);
  EXPECT_EQ(file.grids[1].descriptor.name, "heat");
}

TEST_F(Vdb2Esvr, refusesWhatTakesMoreMemoryThanAllowed) {
  const auto run = fitQuickly({"--max-memory", "100B"});
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_THAT(run.err, HasSubstr("density"));
  EXPECT_FALSE(outIsThere());
}

/// A command line of a shell that runs vdb2esvr quickly.
std::string quickly(const std::string& input, const std::string& output) {
  return std::string(VDB2ESVR) + " " + input + " " + output + " --lossless -q";
}

TEST_F(Vdb2Esvr, readsAPipe) {
  ASSERT_EQ(test::vdb2esvr({in(), out(), "--lossless"}).exitCode, 0);
  const std::string expected = test::readText(out());
  for (const std::string& line :
       {"cat " + in() + " | " + quickly("-", folder_ / "piped.esvr"),
        quickly("-", folder_ / "piped.esvr") + " < " + in(),
        "mkfifo " + std::string(folder_ / "pipe") + "; cat " + in() + " > " +
            std::string(folder_ / "pipe") + " & " + "sleep 0.2; " +
            quickly(folder_ / "pipe", folder_ / "piped.esvr")}) {
    const auto run = test::runProgram("/bin/sh", {"-c", line});
    EXPECT_EQ(run.exitCode, 0) << line << run.err;
    EXPECT_EQ(test::readText(folder_ / "piped.esvr"), expected) << line;
    std::filesystem::remove(folder_ / "piped.esvr");
  }
  const auto back = test::runProgram(
      "/bin/sh",
      {"-c", std::string(ESVR2VDB) + " - " + std::string(folder_ / "back.vdb") + " < " + out()});
  EXPECT_EQ(back.exitCode, 0) << back.err;
}

TEST_F(Vdb2Esvr, leavesNoCopyOfAPipeAndRefusesOtherBytes) {
  std::filesystem::create_directory(folder_ / "tmp");
  const std::string tmp = "TMPDIR=" + std::string(folder_ / "tmp") + " ";
  const auto good = test::runProgram("/bin/sh", {"-c", tmp + quickly("-", out()) + " < " + in()});
  EXPECT_EQ(good.exitCode, 0) << good.err;
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "tmp"));
  const auto endless =
      test::runProgram("/bin/sh", {"-c", tmp + quickly("-", folder_ / "x.esvr") + " < /dev/zero"});
  EXPECT_EQ(endless.exitCode, 3);
  EXPECT_THAT(endless.err, HasSubstr("standard input is neither"));
  EXPECT_EQ(test::vdb2esvr({"-", folder_ / "x.esvr"}).exitCode, 3) << "an empty input";
  const auto cut = test::runProgram(
      "/bin/sh", {"-c", "head -c 300 " + in() + " | " + tmp + quickly("-", folder_ / "x.esvr")});
  EXPECT_EQ(cut.exitCode, 3);
  EXPECT_THAT(cut.err, HasSubstr("esvr-standard-input-"));
}

TEST_F(Vdb2Esvr, fitsNoMixtureOfAFileThatIsReplacedWhileItIsReadSlow) {
  const std::string other = folder_ / "other.vdb", next = folder_ / "next.vdb";
  test::writeInput(
      in(), {{.name = "a", .voxels = test::cloud(8)}, {.name = "b", .voxels = test::cloud(8)}});
  test::writeInput(other,
                   {{.name = "a", .voxels = softBall({})}, {.name = "b", .voxels = softBall({})}});
  test::RunningProgram run(VDB2ESVR, {in(), out(), "--count", "60", "--iterations", "4000"});
  while (run.runs() && !run.handlesInterrupts()) {
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // it has read the list of grids
  std::filesystem::copy_file(other, next);
  std::filesystem::rename(next, in());
  const auto ended = run.wait();
  EXPECT_EQ(ended.exitCode, 3) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("was replaced while it was read"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Vdb2Esvr, hasAMostNumberOfThreads) {
  EXPECT_EQ(fitQuickly({"--threads", "2147483647"}).exitCode, 2);
  EXPECT_EQ(fitQuickly({"--threads", "4096"}).exitCode, 0);
}

TEST_F(Vdb2Esvr, overwritesNoInputThroughALink) {
  const std::string before = test::readText(in());
  std::filesystem::create_symlink(in(), folder_ / "report.json");
  const auto run = fitQuickly({"--force", "--report", folder_ / "report.json"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("are one file"));
  std::filesystem::copy_file(in(), folder_ / "f.1.vdb");
  std::filesystem::create_symlink(folder_ / "f.1.vdb", folder_ / "frames.json");
  std::filesystem::create_symlink(folder_ / "f.1.vdb", folder_ / "o.1.esvr");
  const auto report = test::vdb2esvr({folder_ / "f.@.vdb", folder_ / "new.@.esvr", "--force",
                                      "--report", folder_ / "frames.json"});
  EXPECT_EQ(report.exitCode, 2) << report.err;
  const auto frames = test::vdb2esvr({folder_ / "f.@.vdb", folder_ / "o.@.esvr", "--force"});
  EXPECT_EQ(frames.exitCode, 2) << frames.err;
  EXPECT_EQ(test::readText(in()), before);
  EXPECT_EQ(test::readText(folder_ / "f.1.vdb"), before);
}

TEST_F(Vdb2Esvr, writesNoMessageIntoAFileIfStandardErrorIsClosed) {
  std::filesystem::copy_file(in(), folder_ / "f.1.vdb");
  std::filesystem::copy_file(in(), folder_ / "f.2.vdb");
  const std::string command = std::string(VDB2ESVR) + " '" + std::string(folder_ / "f.@.vdb") +
                              "' " + out() + " --lossless";
  ASSERT_EQ(test::runProgram("/bin/sh", {"-c", command + " -q"}).exitCode, 0);
  const std::string expected = test::readText(out());
  for (const char* closed : {" 2>&-", " >&- 2>&- <&-"}) {
    (void)test::runProgram("/bin/sh", {"-c", command + " --force -v" + closed});
    EXPECT_EQ(test::readText(out()), expected) << closed;
  }
}

class RefusedOptions : public Vdb2Esvr, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedOptions, areNamedAndLeaveNoFile) {
  std::vector<std::string> arguments{in(), out()};
  arguments.insert(arguments.end(), GetParam().arguments.begin(), GetParam().arguments.end());
  GetParam().expectOf(vdb2esvr(arguments));
  EXPECT_FALSE(outIsThere());
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedOptions,
    testing::Values(
        Refusal{{"--size", "5XB"}, 2, "--size"},
        Refusal{{"--size", "9KB", "--psnr", "40"}, 2, "--psnr"},
        Refusal{{"--size", "9KB", "--ratio", "9"}, 2, "--ratio"},
        Refusal{{"--ratio", "0.5"}, 2, "--ratio"}, Refusal{{"--max-error", "0"}, 2, "--max-error"},
        Refusal{{"--max-error", "1x"}, 2, "--max-error"},
        Refusal{{"--representation", "voxels", "--count", "9"}, 2, "--count"},
        Refusal{{"--representation", "cubes"}, 2, "cubes"},
        Refusal{{"--representation", "ellipsoids", "--lossless"}, 2, "--lossless"},
        Refusal{
            {"--representation", "voxels", "--psnr", "40", "--storage", "float32"}, 2, "float32"},
        Refusal{{"--lossless", "--psnr", "40"}, 2, "--psnr"}, Refusal{{"--size", "99"}, 2, "bytes"},
        Refusal{{"--count", "0"}, 2, "--count"}, Refusal{{"--count", "x"}, 2, "x"},
        Refusal{{"--psnr", "-1"}, 2, "--psnr"}, Refusal{{"--psnr", "nan"}, 2, "psnr"},
        Refusal{{"--seconds", "0"}, 2, "--seconds"},
        Refusal{{"--iterations", "0"}, 2, "--iterations"}, Refusal{{"--preset", "best"}, 2, "best"},
        Refusal{{"--box", "1,2,3"}, 2, "--box"}, Refusal{{"--box", "5,5,5,1,1,1"}, 2, "no voxel"},
        Refusal{{"--max-error", "1%", "--paper", "epochs=9"}, 2, "--paper"},
        Refusal{{"--max-error", "1%", "--preset", "paper", "--iterations", "9"}, 2, "paper"},
        Refusal{{"--lossless", "--max-error", "1%"}, 2, "--max-error"},
        Refusal{{"--share", "density"}, 2, "--share"},
        Refusal{{"--paper", "default", "--iterations", "9"}, 2, "--iterations"},
        Refusal{{"--paper", "default", "--preset", "high"}, 2, "--preset"},
        Refusal{{"--paper", "default", "--size", "9KB"}, 2, "--paper"},
        Refusal{{"--paper", "sharpness=3"}, 2, "no key 'sharpness'"},
        Refusal{{"--paper", "k"}, 2, "KEY=VALUE"}, Refusal{{"--paper", "k=soft"}, 2, "soft"},
        Refusal{{"--paper", "k=3,k=4"}, 2, "twice"}, Refusal{{"--paper", "beta=2"}, 2, "beta"},
        Refusal{{"--paper", "epochs=0"}, 2, "epochs"},
        Refusal{{"--paper", "rates=1:2:3"}, 2, "four rates"},
        Refusal{{"--paper", "k=learned", "--storage", "compact"}, 2, "edge"},
        Refusal{{"--paper", "kernel=gaussian,k=3"}, 2, "Gaussians"},
        Refusal{{"--paper", "prunes=2"}, 2, "prunes"},
        Refusal{{"--paper", "prune-score=best"}, 2, "best"}, Refusal{{"--device", "tpu"}, 2, "tpu"},
        Refusal{{"--device", "cuda:4096"}, 5, "cuda:4096"},
        Refusal{{"--report", "report.txt"}, 2, ".json"},
        Refusal{{"more"}, 2, "unexpected argument"}));

}  // namespace
}  // namespace esvr
