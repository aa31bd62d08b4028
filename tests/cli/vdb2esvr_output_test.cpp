// Plan: vdb2esvr is run where its output cannot or must not be written, and is interrupted. The
// tests check the files that are there afterwards.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <thread>

#include "cli/vdb2esvr_fixture.h"
#include "esvr/container.h"

namespace esvr {
namespace {

using test::quickFit;
using test::softBall;
using test::Vdb2Esvr;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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
    test::writeInput(in(), {{.voxels = softBall({})}, {.name = "heat", .voxels = softBall({})}});
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
  // 2.1 million voxels, of which nothing but a search for a size takes minutes.
  const std::string large = folder_ / "large.vdb";
  ASSERT_EQ(test::runProgram(ESVR_SAMPLE, {"plume", large, "--resolution", "200"}).exitCode, 0);
  for (const int signal : {SIGINT, SIGTERM})
    for (const double after : {0.3, 2.0, 8.0, 20.0}) {
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

}  // namespace
}  // namespace esvr
