// Plan: the ranks of MPI write the bytes of one process. If a rank is killed, the others end, and a
// later run continues from the finished parts. Ranks that do not agree end with a message. What is wrong for all ranks is told once, and what is wrong for
// one is told with its number. An interrupted run writes its best result.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <thread>

#include "cli/converters.h"
#include "cli/run_program.h"
#include "cli/vdb_inputs.h"

namespace esvr {
namespace {

using testing::HasSubstr;

class RanksTest : public test::FolderTest {
 protected:
  void SetUp() override {
    // More ranks than cores, also for root, as in a container; the names are those of Open MPI.
    for (const char* name : {"OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
                             "OMPI_MCA_rmaps_base_oversubscribe"})
      ::setenv(name, "1", 1);
    test::writeInput(at("in.vdb"), {{.voxels = test::cloud(8)}});
  }
  [[nodiscard]] std::vector<std::string> conversion(const std::string& name,
                                                    const std::vector<std::string>& more) const {
    std::vector<std::string> all{VDB2ESVR,     at("in.vdb"),   at(name), "--count",
                                 "40",         "--iterations", "60",     "--representation",
                                 "ellipsoids", "--device",     "cpu"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  /// Runs a command on several ranks.
  static test::ProgramRun onRanks(const std::string& count, std::vector<std::string> command) {
    // Ranks that wait for each other would never end.
    command.insert(command.begin(), {"60", ESVR_MPIEXEC, "-n", count});
    return test::runProgram("/usr/bin/timeout", command);
  }
  /// Runs a conversion on two ranks. A shell of rank 1 runs `script` in place of it, where "$@" is
  /// the command.
  static test::ProgramRun withRankOne(const std::string& script, std::vector<std::string> command) {
    const std::string both = "if [ $OMPI_COMM_WORLD_RANK = 0 ]; then exec \"$@\"; fi; " + script;
    command.insert(command.begin(), {"/bin/sh", "-c", both, "sh"});
    return onRanks("2", command);
  }
  void expectSameBytes(const std::string& name) const {
    auto alone = conversion("one.esvr", {"--chunk-voxels", "600"});
    EXPECT_EQ(test::runProgram(alone[0], {alone.begin() + 1, alone.end()}).exitCode, 0);
    EXPECT_EQ(test::readText(at(name)), test::readText(at("one.esvr")));
  }
};

TEST_F(RanksTest, WriteTheBytesOfOneProcess) {
  for (const char* count : {"2", "3"}) {
    const auto run = onRanks(count, conversion("out.esvr", {"--chunk-voxels", "600", "--force"}));
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("density"));
    expectSameBytes("out.esvr");
    std::filesystem::remove(at("one.esvr"));
  }
}

TEST_F(RanksTest, EndWhereOneIsKilledAndContinueLater) {
  const auto command = conversion("out.esvr", {"--chunk-voxels", "600", "--resume"});
  const auto killed = withRankOne("\"$@\" & until ls " + at("out.esvr.parts") +
                                      "/*.part >/dev/null 2>&1; do sleep 0.01; done; "
                                      "kill -9 $!; wait $!",
                                  command);
  EXPECT_NE(killed.exitCode, 0);
  EXPECT_FALSE(std::filesystem::exists(at("out.esvr")));
  EXPECT_EQ(onRanks("2", command).exitCode, 0);
  expectSameBytes("out.esvr");
  EXPECT_FALSE(std::filesystem::exists(at("out.esvr.parts")));
}

TEST_F(RanksTest, SayThatTheyDivideTheVolumeDifferently) {
  const auto run = withRankOne("exec \"$@\" --chunk-voxels 300", conversion("out.esvr", {}));
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("divided the volume differently"));
}

TEST_F(RanksTest, KeepTheExitCodeOfAMissedTarget) {
  const auto run = onRanks(
      "2", conversion("out.esvr", {"--chunk-voxels", "600", "--psnr", "200", "--seconds", "1"}));
  EXPECT_EQ(run.exitCode, 4) << run.err;
  EXPECT_TRUE(std::filesystem::exists(at("out.esvr")));
}

/// How often a text is there.
std::size_t countOf(const std::string& text, const std::string& all) {
  std::size_t count = 0;
  for (std::size_t at = all.find(text); at != all.npos; at = all.find(text, at + 1)) ++count;
  return count;
}

TEST_F(RanksTest, SayOnceWhatIsWrongForAll) {
  const auto wrong = onRanks("3", conversion("out.esvr", {"--no-such-option"}));
  EXPECT_EQ(wrong.exitCode, 2);
  EXPECT_EQ(countOf("no-such-option", wrong.err), 1u) << wrong.err;
  EXPECT_EQ(countOf("--help", wrong.err), 1u) << wrong.err;
  const auto missing = onRanks("3", {VDB2ESVR, at("none.vdb"), at("out.esvr")});
  EXPECT_EQ(missing.exitCode, 3);
  EXPECT_EQ(countOf("none.vdb", missing.err), 1u) << missing.err;
  const auto help = onRanks("2", {VDB2ESVR, "--help"});
  EXPECT_EQ(help.exitCode, 0);
  EXPECT_EQ(help.out, test::runProgram(VDB2ESVR, {"--help"}).out);
}

TEST_F(RanksTest, WarnsWhereARankUsesFewOfItsCores) {
  if (std::thread::hardware_concurrency() < 2) GTEST_SKIP() << "one core is all that there is";
  auto bound = conversion("out.esvr", {});
  bound.insert(bound.begin(), {"--bind-to", "hwthread"});
  const auto onOne = onRanks("1", bound);
  EXPECT_EQ(countOf("--bind-to none", onOne.err), 1u) << onOne.err;
  auto command = conversion("out.esvr", {"--force"});
  command.insert(command.begin(), {"--bind-to", "none"});
  const auto free = onRanks("1", command);
  EXPECT_EQ(free.exitCode, 0);
  EXPECT_EQ(countOf("--bind-to none", free.err), 0u) << free.err;
}

TEST_F(RanksTest, SaysWhichRankFailsAlone) {
  const auto run = withRankOne("exec \"$1\" " + at("none.vdb") + " " + at("out.esvr"),
                               conversion("out.esvr", {"--chunk-voxels", "600"}));
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("rank 1: "));
  EXPECT_THAT(run.err, HasSubstr("none.vdb"));
}

TEST_F(RanksTest, SlowWriteTheBestResultWhenInterrupted) {
  // Open MPI always waits so long before it kills ranks, and these write their result first.
  ::setenv("OMPI_MCA_odls_base_sigkill_timeout", "4", 1);
  auto command = conversion("out.esvr", {"--chunk-voxels", "600"});
  *std::next(std::ranges::find(command, "--iterations")) = "10000000";
  command.insert(command.begin(), {"-n", "2"});
  test::RunningProgram program(ESVR_MPIEXEC, command);
  const auto says = [&] { return program.err().find("best result so far") != std::string::npos; };
  while (program.runs() && !says()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_TRUE(program.runs()) << program.err();
  std::this_thread::sleep_for(std::chrono::seconds(1));  // there is something to write
  program.send(SIGINT);
  const auto run = program.wait();
  EXPECT_NE(run.exitCode, 0);
  EXPECT_EQ(countOf("interrupted;", run.err), 1u) << run.err;
  EXPECT_TRUE(std::filesystem::exists(at("out.esvr"))) << run.err;
}

}  // namespace
}  // namespace esvr
