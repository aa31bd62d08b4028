// Plan: the options that all programs share are tested with every program. The messages of the
// dynamic linker (LD_DEBUG=files, ld.so(8)) name every library that a command loads or looks for.
// Commands that need no device must not look for CUDA's driver; a conversion on a GPU must, which
// shows that the messages are complete.

#include <algorithm>
#include <cstdlib>
#include <regex>
#include <sstream>
#include <string_view>

#include "cli/converters.h"
#include "esvr/device.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

struct ProgramCommand {
  const char* name;
  const char* path;
  Words arguments;  ///< arguments of a run of milliseconds; "DIR/x" is in the test's folder
};
std::ostream& operator<<(std::ostream& out, const ProgramCommand& program) {
  return out << program.name;
}

/// The lines that a program printed, without numbers, which may be times as short as 1e-05 seconds,
/// and without the spaces and dashes of tables, whose widths depend on them.
Words linesOf(const ProgramRun& run) {
  static const std::regex numbers("[0-9][0-9.]*(e[-+][0-9]+)?");
  std::string text = std::regex_replace(run.out + run.err, numbers, "");
  std::erase_if(text,
                [](char c) { return std::string_view(" .-").find(c) != std::string_view::npos; });
  Words lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

class EveryProgram : public FolderTest, public testing::WithParamInterface<ProgramCommand> {
 protected:
  void SetUp() override {
    writeInput(at("in.vdb"), {{.voxels = softBall({})}});
    succeeded(quickFit(at("in.vdb"), at("in.esvr")));
  }
  [[nodiscard]] ProgramRun run(const Words& more) const {
    Words arguments = GetParam().arguments;
    for (auto& argument : arguments)
      if (argument.starts_with("DIR/")) argument = at(argument.substr(4));
    const auto result = succeeded(runProgram(GetParam().path, joined(arguments, more)));
    return result;
  }
  /// The command of a program that has several.
  [[nodiscard]] Words job() const {
    if (std::string(GetParam().path) != ESVR_COMPARE) return {};
    return {GetParam().arguments[0]};
  }
};

TEST_P(EveryProgram, helpAndVersionNeedNoFiles) {
  Words job = this->job();
  for (const char* option : {"--help", "-h"}) {
    auto arguments = job;
    arguments.emplace_back(option);
    EXPECT_THAT(runProgram(GetParam().path, arguments).out, Says("Usage:", "--version"));
  }
  job.emplace_back("--version");
  EXPECT_THAT(runProgram(GetParam().path, job).out, Says("0.", "OpenVDB"));
}

TEST_P(EveryProgram, helpFitsOnTwoScreens) {
  constexpr std::ptrdiff_t kTwoScreens = 100;  // lines
  Words arguments = job();
  arguments.emplace_back("--help");
  const std::string help = runProgram(GetParam().path, arguments).out;
  EXPECT_LE(std::ranges::count(help, '\n'), kTwoScreens);
}

TEST_P(EveryProgram, saysNothingWhereQuietAndMoreWhereVerbose) {
  const auto quiet = run("--quiet"), usual = run({}), verbose = run("--verbose");
  EXPECT_THAT(quiet.out + quiet.err, IsEmpty());
  EXPECT_THAT(linesOf(verbose), testing::IsSupersetOf(linesOf(usual)));
}

TEST_P(EveryProgram, takesANumberOfThreads) {
  (void)run("--threads 1");
  auto arguments = GetParam().arguments;
  EXPECT_THAT(runProgram(GetParam().path, joined(arguments, "--threads 0")), Fails(2, "threads"));
}

TEST_P(EveryProgram, saysWhichOptionAMistypedOneMayBe) {
  auto arguments = job();
  EXPECT_THAT(runProgram(GetParam().path, joined(arguments, "--thraeds 1")),
              Fails(2, "--thraeds", "; did you mean --threads?\n"));
}

INSTANTIATE_TEST_SUITE_P(
    All, EveryProgram,
    testing::Values(ProgramCommand{"vdb2esvr",
                                   VDB2ESVR,
                                   {"DIR/in.vdb", "DIR/o.esvr", "--force", "--count", "9",
                                    "--iterations", "30"}},
                    ProgramCommand{"esvr2vdb", ESVR2VDB, {"DIR/in.esvr", "DIR/o.vdb", "--force"}},
                    ProgramCommand{"render",
                                   ESVR_RENDER,
                                   {"DIR/in.esvr", "DIR/o.png", "--force", "--resolution", "16x16",
                                    "--device", "cpu"}},
                    ProgramCommand{"check", ESVR_COMPARE, {"check", "DIR/in.vdb", "DIR/in.esvr"}},
                    ProgramCommand{
                        "table",
                        ESVR_COMPARE,
                        {"table", "DIR/in.vdb", "DIR/in.esvr", "--rows", "none", "--runs", "1"}},
                    ProgramCommand{"curves",
                                   ESVR_COMPARE,
                                   {"curves", "DIR/in.vdb", "DIR/in.esvr", "--no-baselines", "-o",
                                    "DIR/c", "--force"}}),
    [](const auto& tested) { return std::string(tested.param.name); });

constexpr const char* kDriver = "libcuda.so";

class Start : public FolderTest {
 protected:
  void SetUp() override {
    writeInput(at("in.vdb"), {{.voxels = softBall({})}});
    succeeded(quickFit(at("in.vdb"), at("in.esvr")));
  }

  /// What the dynamic linker says about a run.
  static std::string librariesOf(const char* program, const Words& arguments) {
    ::setenv("LD_DEBUG", "files", 1);
    const auto run = runProgram(program, arguments);
    ::unsetenv("LD_DEBUG");
    EXPECT_THAT(run.err, HasSubstr("libstdc++")) << "the linker says nothing";
    return run.err;
  }
};

TEST_F(Start, doesNotLookForADriverWithoutADevice) {
  for (const char* job : {"--list", "--check"})
    EXPECT_THAT(librariesOf(ESVR2VDB, {job, at("in.esvr")}), Not(HasSubstr(kDriver))) << job;
  EXPECT_THAT(librariesOf(ESVR2VDB, {"--list", at("in.vdb")}), Not(HasSubstr(kDriver)));
  EXPECT_THAT(librariesOf(ESVR2VDB, {at("in.esvr"), at("back.vdb")}), Not(HasSubstr(kDriver)));
  EXPECT_THAT(librariesOf(VDB2ESVR, {at("in.vdb"), at("o.esvr"), "--lossless", "--device", "cpu"}),
              Not(HasSubstr(kDriver)));
}

TEST_F(Start, doesNotLookForADriverForHelp) {
  for (const char* program : {VDB2ESVR, ESVR2VDB, ESVR_RENDER, ESVR_VIEW, ESVR_COMPARE})
    EXPECT_THAT(librariesOf(program, "--help"), Not(HasSubstr(kDriver))) << program;
}

TEST_F(Start, looksForADriverOnlyIfTheBuildHasCuda) {
  const auto libraries =
      librariesOf(VDB2ESVR, {at("in.vdb"), at("o.esvr"), "--lossless", "--device", "cuda"});
  EXPECT_EQ(libraries.find(kDriver) != std::string::npos, builtWithCuda());
}

}  // namespace
}  // namespace esvr::test
