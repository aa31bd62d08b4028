// Plan: vdb2esvr is run on files that it cannot read, on grids that it cannot convert, and on
// several grids. The tests check exit codes and messages, and that refused input leaves no file
// behind.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <thread>

#include "cli/vdb2esvr_fixture.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "support/non_finite.h"

namespace esvr {
namespace {

using test::InputGrid;
using test::kInf;
using test::kNan;
using test::quickFit;
using test::softBall;
using test::Vdb2Esvr;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

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
  for (const char* wrong : {"keep", "nan", "1e99", ""})
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

}  // namespace
}  // namespace esvr
