// Plan: the ranks of MPI write the bytes of one process. If a rank is killed, the others end, and a
// later run continues from the finished parts. Ranks that do not agree end with a message. What is wrong for all ranks is told once, and what is wrong for
// one is told with its number. An interrupted run writes its best result.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iterator>
#include <thread>

#include "cli/conversion.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

class RanksTest : public FolderTest {
 protected:
  void SetUp() override {
    // More ranks than cores, also for root, as in a container; the names are those of Open MPI.
    for (const char* name : {"OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
                             "OMPI_MCA_rmaps_base_oversubscribe"})
      ::setenv(name, "1", 1);
    writeInput(at("in.vdb"), {{.voxels = cloud(8)}});
  }
  [[nodiscard]] Words conversion(const std::string& name, const Words& more) const {
    return joined({VDB2ESVR, at("in.vdb"), at(name), "--count", "40", "--iterations", "60",
                   "--representation", "ellipsoids", "--device", "cpu"},
                  more);
  }
  /// Runs a command on several ranks.
  static ProgramRun onRanks(const std::string& count, const Words& command) {
    // Ranks that wait for each other would never end.
    return runProgram("/usr/bin/timeout", joined({"60", ESVR_MPIEXEC, "-n", count}, command));
  }
  /// Runs a conversion on two ranks. A shell of rank 1 runs `script` in place of it, where "$@" is
  /// the command.
  static ProgramRun withRankOne(const std::string& script, const Words& command) {
    const std::string both = "if [ $OMPI_COMM_WORLD_RANK = 0 ]; then exec \"$@\"; fi; " + script;
    return onRanks("2", joined({"/bin/sh", "-c", both, "sh"}, command));
  }
  void expectSameBytes(const std::string& name) const {
    auto alone = conversion("one.esvr", "--chunk-voxels 600");
    succeeded(runProgram(alone[0], {alone.begin() + 1, alone.end()}));
    EXPECT_EQ(readText(at(name)), readText(at("one.esvr")));
  }
};

TEST_F(RanksTest, WriteTheBytesOfOneProcess) {
  for (const char* count : {"2", "3"}) {
    EXPECT_THAT(succeeded(onRanks(count, conversion("out.esvr", "--chunk-voxels 600 --force"))).out,
                HasSubstr("density"));
    expectSameBytes("out.esvr");
    std::filesystem::remove(at("one.esvr"));
  }
}

TEST_F(RanksTest, EndWhereOneIsKilledAndContinueLater) {
  const auto command = conversion("out.esvr", "--chunk-voxels 600 --resume");
  const auto killed = withRankOne("\"$@\" & until ls " + at("out.esvr.parts") +
                                      "/*.part >/dev/null 2>&1; do sleep 0.01; done; "
                                      "kill -9 $!; wait $!",
                                  command);
  EXPECT_NE(killed.exitCode, 0);
  EXPECT_FALSE(std::filesystem::exists(at("out.esvr")));
  succeeded(onRanks("2", command));
  expectSameBytes("out.esvr");
  EXPECT_FALSE(std::filesystem::exists(at("out.esvr.parts")));
}

TEST_F(RanksTest, SayThatTheyDivideTheVolumeDifferently) {
  EXPECT_THAT(withRankOne("exec \"$@\" --chunk-voxels 300", conversion("out.esvr", {})),
              Fails(1, "divided the volume differently"));
}

TEST_F(RanksTest, KeepTheExitCodeOfAMissedTarget) {
  EXPECT_THAT(onRanks("2", conversion("out.esvr", {"--chunk-voxels", "600", "--psnr", "200",
                                                   "--seconds", "1"})),
              Fails(4));
  EXPECT_TRUE(std::filesystem::exists(at("out.esvr")));
}

TEST_F(RanksTest, SayOnceWhatIsWrongForAll) {
  const auto wrong = onRanks("3", conversion("out.esvr", "--no-such-option"));
  EXPECT_EQ(wrong.exitCode, 2);
  EXPECT_EQ(timesIn(wrong.err, "no-such-option"), 1u) << wrong.err;
  EXPECT_EQ(timesIn(wrong.err, "--help"), 1u) << wrong.err;
  const auto missing = onRanks("3", {VDB2ESVR, at("none.vdb"), at("out.esvr")});
  EXPECT_EQ(missing.exitCode, 3);
  EXPECT_EQ(timesIn(missing.err, "none.vdb"), 1u) << missing.err;
  const auto help = succeeded(onRanks("2", {VDB2ESVR, "--help"}));
  EXPECT_EQ(help.out, runProgram(VDB2ESVR, "--help").out);
}

TEST_F(RanksTest, WarnsWhereARankUsesFewOfItsCores) {
  if (std::thread::hardware_concurrency() < 2) GTEST_SKIP() << "one core is all that there is";
  auto bound = conversion("out.esvr", {});
  const auto onOne = onRanks("1", joined("--bind-to hwthread", bound));
  EXPECT_EQ(timesIn(onOne.err, "--bind-to none"), 1u) << onOne.err;
  auto command = conversion("out.esvr", "--force");
  const auto free = succeeded(onRanks("1", joined("--bind-to none", command)));
  EXPECT_EQ(timesIn(free.err, "--bind-to none"), 0u) << free.err;
}

TEST_F(RanksTest, SaysWhichRankFailsAlone) {
  const auto run = withRankOne("exec \"$1\" " + at("none.vdb") + " " + at("out.esvr"),
                               conversion("out.esvr", "--chunk-voxels 600"));
  EXPECT_THAT(run, Fails(3, "rank 1: "));
  EXPECT_THAT(run.err, HasSubstr("none.vdb"));
}

TEST_F(RanksTest, SlowWriteTheBestResultWhenInterrupted) {
  // Open MPI always waits so long before it kills ranks, and these write their result first.
  ::setenv("OMPI_MCA_odls_base_sigkill_timeout", "4", 1);
  auto command = conversion("out.esvr", "--chunk-voxels 600");
  *std::next(std::ranges::find(command, "--iterations")) = "10000000";
  RunningProgram program(ESVR_MPIEXEC, joined("-n 2", command));
  const auto says = [&] { return program.err().find("best result so far") != std::string::npos; };
  while (program.runs() && !says()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_TRUE(program.runs()) << program.err();
  std::this_thread::sleep_for(std::chrono::seconds(1));  // there is something to write
  program.send(SIGINT);
  const auto run = program.wait();
  EXPECT_NE(run.exitCode, 0);
  EXPECT_EQ(timesIn(run.err, "interrupted;"), 1u) << run.err;
  EXPECT_TRUE(std::filesystem::exists(at("out.esvr"))) << run.err;
}

}  // namespace
}  // namespace esvr::test
