// Plan: the tests check the results of command lines, the messages for wrong ones, the exit code
// of every exception, and signals.

#include "programs/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <new>
#include <sstream>
#include <thread>

#include "esvr/error.h"
#include "programs/run_main.h"
#include "programs/workers.h"

namespace esvr::cli {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;
using testing::internal::CaptureStderr;
using testing::internal::CaptureStdout;
using testing::internal::GetCapturedStderr;
using testing::internal::GetCapturedStdout;

CommandLine exampleLine() {
  CommandLine line({.name = "esvr-example",
                    .purpose = "Does an example.",
                    .usage = "  esvr-example IN OUT [options]",
                    .notes = "",
                    .examples = "  esvr-example a b"});
  line.argument("input", "IN");
  line.argument("output", "OUT");
  // clang-format off
  line.options().add_options()
    ("size,s", po::value<int>()->value_name("N")->default_value(7), "how large")
    ("low", po::value<double>()->value_name("X"), "the lowest");
  // clang-format on
  return line;
}

std::optional<Arguments> parse(std::vector<const char*> given) {
  given.insert(given.begin(), "esvr-example");
  return exampleLine().parse(int(given.size()), given.data());
}

TEST(CommandLine, takesArgumentsAndOptionsInAnyOrder) {
  const auto a = parse({"--size", "3", "in", "-q", "out"});
  ASSERT_TRUE(a);
  EXPECT_EQ(a->get<std::string>("input"), "in");
  EXPECT_EQ(a->get<std::string>("output"), "out");
  EXPECT_EQ(a->get<int>("size"), 3);
  EXPECT_EQ(a->verbosity, Verbosity::kQuiet);
  EXPECT_EQ(a->threads, 0);
}

TEST(CommandLine, collectsAllFurtherArgumentsWhereThatIsWanted) {
  CommandLine line = exampleLine();
  line.repeatedArgument("more");
  const char* given[] = {"esvr-example", "in", "out", "a", "--size", "3", "b"};
  const auto a = line.parse(7, given);
  ASSERT_TRUE(a);
  EXPECT_EQ(a->get<std::vector<std::string>>("more"), (std::vector<std::string>{"a", "b"}));
  const auto none = line.parse(3, given);
  ASSERT_TRUE(none);
  EXPECT_FALSE(none->has("more"));
}

TEST(CommandLine, knowsDefaultsAndWhatWasNotGiven) {
  const auto a = parse({"in", "out"});
  EXPECT_EQ(a->get<int>("size"), 7);
  EXPECT_FALSE(a->has("low"));
  EXPECT_EQ(a->find<double>("low"), std::nullopt);
  EXPECT_EQ(a->verbosity, Verbosity::kNormal);
}

TEST(CommandLine, takesNegativeNumbersAsValues) {
  EXPECT_EQ(parse({"in", "out", "--low", "-2.5"})->get<double>("low"), -2.5);
  EXPECT_EQ(parse({"in", "out", "--low=-2.5"})->get<double>("low"), -2.5);
}

TEST(CommandLine, takesFilesThatBeginWithADashAfterTwoDashes) {
  EXPECT_EQ(parse({"in", "--", "-out"})->get<std::string>("output"), "-out");
}

struct Refusal {
  std::vector<const char*> given;
  const char* text;
};

class Refused : public testing::TestWithParam<Refusal> {};

TEST_P(Refused, asAUsageErrorThatSaysWhy) {
  EXPECT_THAT([&] { (void)parse(GetParam().given); },
              ThrowsMessage<UsageError>(HasSubstr(GetParam().text)));
}

INSTANTIATE_TEST_SUITE_P(
    CommandLine, Refused,
    testing::Values(Refusal{{}, "missing argument IN"}, Refusal{{"in"}, "missing argument OUT"},
                    Refusal{{"in", "out", "more"}, "unexpected argument 'more'"},
                    Refusal{{"in", "out", "--sise", "3"}, "--sise"},
                    Refusal{{"in", "out", "--size", "three"}, "three"},
                    Refusal{{"in", "out", "--size"}, "--size"},
                    Refusal{{"in", "out", "--size=1", "--size=2"}, "size"},
                    Refusal{{"in", "out", "--threads", "0"}, "--threads"},
                    Refusal{{"in", "out", "--threads", "-3"}, "--threads"}));

TEST(CommandLine, helpSaysAllAndNeedsNoArguments) {
  CaptureStdout();
  EXPECT_FALSE(parse({"--help"}));
  const std::string help = GetCapturedStdout();
  for (const char* part : {"Does an example.", "esvr-example IN OUT", "-s [ --size ] N", "(=7)",
                           "--threads", "--version", "Examples:"})
    EXPECT_THAT(help, HasSubstr(part));
  EXPECT_THAT(help, testing::Not(HasSubstr("Notes:"))) << "an empty section is left out";
}

/// What a command line prints for `--help` and a topic.
std::string helpOf(const CommandLine& line, const char* topic) {
  const char* const given[] = {"esvr-example", "--help", topic};
  CaptureStdout();
  EXPECT_FALSE(line.parse(3, given));
  return GetCapturedStdout();
}

TEST(CommandLine, expertHelpHasWhatTheMainHelpLeavesOut) {
  CommandLine line({.name = "esvr-example",
                    .purpose = "Does an example.",
                    .usage = "  esvr-example",
                    .notes = "For all.",
                    .details = "For experts.",
                    .examples = ""});
  line.options().add_options()("size", po::value<int>(), "how large")("low", po::value<int>(), "");
  line.mainOptions({"size"});
  EXPECT_THAT(
      helpOf(line, "x"),
      testing::AllOf(HasSubstr("--size"), HasSubstr("For all."), HasSubstr("--help expert"),
                     testing::Not(HasSubstr("--low")), testing::Not(HasSubstr("For experts."))));
  EXPECT_THAT(helpOf(line, "expert"), testing::AllOf(HasSubstr("--low"), HasSubstr("For experts."),
                                                     testing::Not(HasSubstr("--size"))));
  EXPECT_EQ(helpOf(line, "options").substr(0, 13), "--size\n--low\n");
  EXPECT_THAT(helpOf(line, "man"), testing::AllOf(HasSubstr("low"), HasSubstr("For experts.")));
}

TEST(CommandLine, helpHasAllWhereNothingIsForExperts) {
  EXPECT_THAT(helpOf(exampleLine(), "expert"),
              testing::AllOf(HasSubstr("--size"), HasSubstr("--low"),
                             testing::Not(HasSubstr("--help expert"))));
}

TEST(CommandLine, helpBreaksTheLinesOfParagraphs) {
  std::string words;
  for (int i = 0; i < 40; ++i) words += "word ";
  const CommandLine line({.name = "esvr-example",
                          .purpose = words,
                          .usage = "  esvr-example",
                          .notes = words + "\n  a  table\n" + words,
                          .examples = ""});
  const char* const given[] = {"esvr-example", "--help"};
  CaptureStdout();
  EXPECT_FALSE(line.parse(2, given));
  const std::string help = GetCapturedStdout();
  EXPECT_THAT(help, HasSubstr("word\n  a  table\nword"));
  std::istringstream lines(help);
  for (std::string text; std::getline(lines, text);) EXPECT_LE(text.size(), 80u) << text;
}

TEST(CommandLine, versionNamesEveryPart) {
  CaptureStdout();
  EXPECT_FALSE(parse({"--version"}));
  const std::string text = GetCapturedStdout();
  for (const char* part : {"esvr-example 0.", ".esvr format 1", "OpenVDB", "NanoVDB", "CUDA"})
    EXPECT_THAT(text, HasSubstr(part));
}

TEST(RequireRange, refusesWhatLiesOutsideAndNaN) {
  EXPECT_NO_THROW(requireRange("x", 1, 1, 3));
  EXPECT_THROW(requireRange("x", 4, 1, 3), UsageError);
  EXPECT_THROW(requireRange("x", std::nan(""), 0.0, 1.0), UsageError);
}

struct Ending {
  std::function<int()> body;
  int code;
  const char* text;
};

class RunMain : public testing::TestWithParam<Ending> {};

TEST_P(RunMain, turnsWhatIsThrownIntoCodeAndMessage) {
  CaptureStderr();
  EXPECT_EQ(runMain("prog", GetParam().body), GetParam().code);
  EXPECT_THAT(GetCapturedStderr(), HasSubstr(GetParam().text));
}

template <class E>
std::function<int()> throwing(E error) {
  return [error]() -> int { throw error; };
}

INSTANTIATE_TEST_SUITE_P(
    All, RunMain,
    testing::Values(Ending{[] { return 0; }, 0, ""}, Ending{[] { return 4; }, 4, ""},
                    Ending{throwing(RuntimeFailure("disk full")), 1, "prog: disk full\n"},
                    Ending{throwing(UsageError("no")), 2, "prog: no\nTry 'prog --help'"},
                    Ending{throwing(BadInput("bad")), 3, "prog: bad\n"},
                    Ending{throwing(TargetMissed("low")), 4, "prog: low\n"},
                    Ending{throwing(DeviceError("gone")), 5, "prog: gone\n"},
                    Ending{throwing(std::bad_alloc()), 5, "prog: out of memory\n"},
                    Ending{throwing(std::runtime_error("odd")), 1, "prog: odd\n"}));

TEST(Interrupts, theFirstSignalSetsTheToken) {
  Interrupts interrupts;
  EXPECT_FALSE(interrupts.token().cancelled());
  std::raise(SIGINT);
  EXPECT_TRUE(interrupts.token().cancelled());
}

TEST(InterruptsDeathTest, theSecondSignalEndsTheProcess) {
  EXPECT_EXIT(
      {
        Interrupts interrupts;
        std::raise(SIGTERM);
        std::raise(SIGTERM);
        std::_Exit(0);
      },
      testing::KilledBySignal(SIGTERM), "");
}

TEST(Interrupts, leaveHandlersAsTheyWere) {
  struct sigaction before {
  }, after{};
  sigaction(SIGINT, nullptr, &before);
  { Interrupts interrupts; }
  sigaction(SIGINT, nullptr, &after);
  EXPECT_EQ(before.sa_handler, after.sa_handler);
}

}  // namespace
}  // namespace esvr::cli
