// Plan: sizes and bounds as users write them are parsed, and other texts are refused. The tests check the results of
// command lines, the messages for wrong ones, the exit code of every exception, and signals.
//
// Help: lines are broken between words, at the last place that keeps to the width; what has columns is kept, and so are
// empty lines, and a word that is too long stands alone. A man page has all parts of a help text, with the characters
// escaped that man(7) would take as commands, and the options are named for completion.
//
// A table of known cells is printed at several widths. No line is longer than the width, every cell is there, and rows
// keep their names, whatever is too wide.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <boost/program_options/value_semantic.hpp>

#include <cmath>
#include <csignal>
#include <new>
#include <sstream>
#include <thread>

#include "esvr/error.h"
#include "programs/command_line.h"
#include "programs/option_values.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "support/messages.h"

namespace esvr::cli {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::internal::CaptureStderr;
using testing::internal::CaptureStdout;
using testing::internal::GetCapturedStderr;
using testing::internal::GetCapturedStdout;

// Values.

TEST(Numbers, HaveAsManyDigitsAsItTakesToTellThemApart) {
  using testing::Pair;
  EXPECT_THAT(decibelsApart(39.5, 40.0), Pair("39.50", "40.00"));
  EXPECT_THAT(decibelsApart(39.9996, 40.0), Pair("39.9996", "40.0000"));
  EXPECT_THAT(decibelsApart(40.0, 40.0), Pair("40.00", "40.00"));
  EXPECT_THAT(decibelsApart(40.0, std::nextafter(40.0, 50.0)),
              Pair("40.00000000000000", "40.00000000000001"));
  EXPECT_THAT(decibelsApart(40.0, INFINITY), Pair("40.00", "exact"));
  EXPECT_THAT(shortNumbersApart(0.01000001, 0.01), Pair("0.01000001", "0.01"));
  EXPECT_THAT(shortNumbersApart(1e-30, 0.25), Pair("1e-30", "0.25"));
}

TEST(NumberList, ReadsAsManyNumbersAsAskedFor) {
  EXPECT_THAT(parseNumbers("eye", "1,-2.5,3e2", 3), ElementsAre(1.0, -2.5, 300.0));
  EXPECT_THAT(parseNumbers("range", "0,1", 2), ElementsAre(0.0, 1.0));
}

TEST(NumberList, RefusesAnythingElseAndNamesTheOption) {
  for (const char* text : {"", "1", "1,2", "1,2,3,4", "1,2,x", "1 2 3", "1,,3", "1,2,nan",
                           "1,2,inf", "1,2,1e999", "1,2,3 "})
    EXPECT_THROW((void)parseNumbers("eye", text, 3), UsageError) << text;
  try {
    (void)parseNumbers("eye", "1", 3);
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("--eye must be 3 numbers"));
  }
}

TEST(ByteSize, knowsUnits) {
  EXPECT_EQ(parseByteSize("size", "50000"), 50'000u);
  EXPECT_EQ(parseByteSize("size", "50KB"), 50'000u);
  EXPECT_EQ(parseByteSize("size", "2.6MB"), 2'600'000u);
  EXPECT_EQ(parseByteSize("size", "48kib"), 49'152u);
  EXPECT_EQ(parseByteSize("size", "1GiB"), std::uint64_t{1} << 30);
  EXPECT_EQ(parseByteSize("size", "1.5TB"), 1'500'000'000'000u);
  EXPECT_EQ(parseByteSize("size", "7b"), 7u);
}

TEST(ByteSize, refusesTextThatIsNoSize) {
  for (const char* text : {"", "KB", "-5KB", "0", "0.4", "5 KB", "5XB", "1e300", "nan", "inf"})
    EXPECT_THAT([&] { (void)parseByteSize("size", text); },
                test::ThrowsSaying<UsageError>("--size must be a size"))
        << text;
}

TEST(DeviceMemory, hasTheUnitsOfOtherSizes) {
  EXPECT_EQ(parseDeviceMemory("max-vram", "64MB"), 64'000'000u);
  EXPECT_EQ(parseDeviceMemory("max-vram", "1.5GiB"), std::uint64_t{3} << 29);
  EXPECT_EQ(parseDeviceMemory("max-vram", "64000000"), 64'000'000u);
}

TEST(DeviceMemory, isOfGigabytesWithoutAUnitIfThatIsTheOnlyMeaning) {
  EXPECT_EQ(parseDeviceMemory("max-vram", "4"), 4'000'000'000u);
  EXPECT_EQ(parseDeviceMemory("max-vram", "0.003"), 3'000'000u);
  EXPECT_EQ(parseDeviceMemory("max-vram", "1000000"), 1'000'000u);
}

TEST(DeviceMemory, refusesWhatIsNoMemoryOrTooLittle) {
  for (const char* text : {"", "x", "-4", "0", "4XB", "nan", "1e300"})
    EXPECT_THAT([&] { (void)parseDeviceMemory("max-vram", text); },
                test::ThrowsSaying<UsageError>("--max-vram must be a size"))
        << text;
  for (const char* text : {"999KB", "0.0001"})
    EXPECT_THAT([&] { (void)parseDeviceMemory("max-vram", text); },
                test::ThrowsSaying<UsageError>("at least 1MB"))
        << text;
}

TEST(ErrorBound, isInUnitsOrAShareOfTheRange) {
  EXPECT_EQ(parseErrorBound("max-error", "0.25").absolute(8.0), 0.25);
  EXPECT_EQ(parseErrorBound("max-error", "25%").absolute(8.0), 2.0);
}

TEST(ErrorBound, isAFiniteNumberAboveZero) {
  for (const char* text : {"", "%", "0", "-1", "much", "1x", "1%%", "inf", "nan"})
    EXPECT_THROW((void)parseErrorBound("max-error", text), UsageError) << text;
}

// Command lines.

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
              test::ThrowsSaying<UsageError>(GetParam().text));
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
std::string helpOf(const CommandLine& line, const char* topic = nullptr) {
  const char* const given[] = {"esvr-example", "--help", topic};
  CaptureStdout();
  EXPECT_FALSE(line.parse(topic ? 3 : 2, given));
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
      helpOf(line),
      testing::AllOf(HasSubstr("--size"), HasSubstr("For all."), HasSubstr("--help expert"),
                     testing::Not(HasSubstr("--low")), testing::Not(HasSubstr("For experts."))));
  EXPECT_THAT(helpOf(line, "expert"), testing::AllOf(HasSubstr("--low"), HasSubstr("For experts."),
                                                     testing::Not(HasSubstr("--size"))));
  EXPECT_EQ(helpOf(line, "options").substr(0, 13), "--size\n--low\n");
  EXPECT_THAT(helpOf(line, "man"), test::Says("low", "For experts."));
}

TEST(CommandLine, helpRefusesATopicThatItHasNot) {
  CommandLine line = exampleLine();
  line.helpTopic("paper", "On papers.");
  EXPECT_THAT([&] { (void)helpOf(line, "expret"); },
              test::ThrowsSaying<UsageError>("no topic 'expret', but expert, man, options, paper; "
                                             "did you mean expert?"));
  GetCapturedStdout();
  EXPECT_EQ(helpOf(line, "paper"), "On papers.");
  for (const char* other : {"--quiet", "-s3"}) {
    const char* const given[] = {"esvr-example", "in.vdb", "--help", other};
    CaptureStdout();
    EXPECT_FALSE(line.parse(4, given));
    EXPECT_THAT(GetCapturedStdout(), HasSubstr("Does an example."));
  }
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

TEST(Counted, HasThePluralUnlessThereIsOne) {
  EXPECT_EQ(counted(0, "voxel"), "0 voxels");
  EXPECT_EQ(counted(1, "voxel"), "1 voxel");
  EXPECT_EQ(counted(2, "active voxel"), "2 active voxels");
  EXPECT_EQ(completeOf(1, 3, "frame"), "1 of 3 frames is complete");
  EXPECT_EQ(completeOf(0, 1, "frame"), "0 of 1 frame are complete");
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

// Help.

TEST(WrappedText, BreaksLinesAtTheLastPossibleSpace) {
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("one two three", 6), "one\ntwo\nthree");
  EXPECT_EQ(wrapped("one two three", 13), "one two three");
}

TEST(WrappedText, LeavesALongWordWhole) {
  EXPECT_EQ(wrapped("a incomprehensible b", 5), "a\nincomprehensible\nb");
}

TEST(WrappedText, KeepsColumnsAndEmptyLines) {
  EXPECT_EQ(wrapped("one two\n\n  a    long table\nthree four", 5),
            "one\ntwo\n\n  a    long table\nthree\nfour");
}

TEST(WrappedText, MayBeEmpty) { EXPECT_EQ(wrapped("", 80), ""); }

namespace po = boost::program_options;

class ManPage : public testing::Test {
 protected:
  ManPage() {
    // clang-format off
    own_.add_options()
      ("grid,g", po::value<std::string>()->value_name("NAME"), "write this grid\n.only")
      ("no-tiles", po::bool_switch(), "write leaves");
    // clang-format on
  }
  po::options_description own_;
  ProgramText text_{.name = "esvr-example table",
                    .purpose = "Converts an .esvr file back. It says so.",
                    .usage = "  esvr-example table IN",
                    .notes = "'quoted' \\ note\n\n  a  table\nmore",
                    .examples = ""};
};

TEST_F(ManPage, hasTheNameAndTheFirstSentence) {
  const std::string page = manPage(text_, {{"OPTIONS", &own_}});
  EXPECT_THAT(page, HasSubstr(".TH ESVR-EXAMPLE-TABLE 1 "));
  EXPECT_THAT(page, HasSubstr("esvr\\-example\\-table \\- Converts an .esvr file back\n"));
  EXPECT_THAT(page, HasSubstr(".SH SYNOPSIS\n.nf\n  esvr\\-example table IN\n.fi\n"));
  EXPECT_THAT(page, HasSubstr("It says so."));
  EXPECT_THAT(page, Not(HasSubstr("EXAMPLES"))) << "an empty section";
}

TEST_F(ManPage, hasTheOptions) {
  const std::string page = manPage(text_, {{"OPTIONS", &own_}});
  EXPECT_THAT(page, HasSubstr(".TP\n\\fB\\-g\\fR, \\fB\\-\\-grid\\fR \\fINAME\\fR\n"));
  EXPECT_THAT(page, HasSubstr(".TP\n\\fB\\-\\-no\\-tiles\\fR\nwrite leaves\n"));
}

TEST_F(ManPage, escapesWhatBeginsACommand) {
  const std::string page = manPage(text_, {{"OPTIONS", &own_}});
  EXPECT_THAT(page, HasSubstr("write this grid\n\\&.only"));
  EXPECT_THAT(page, HasSubstr("\\&'quoted' \\e note"));
}

TEST_F(ManPage, keepsTheColumnsOfLinesThatBeginWithASpace) {
  const std::string page = manPage(text_, {{"OPTIONS", &own_}});
  EXPECT_THAT(page, HasSubstr(".SH NOTES\n\\&'quoted'"));
  EXPECT_THAT(page, HasSubstr("\n.nf\n  a  table\n.fi\n.PP\nmore\n"));
}

TEST_F(ManPage, namesOptionsForCompletion) {
  EXPECT_EQ(optionNames({{"OPTIONS", &own_}}), "--grid\n--no-tiles\n");
}

// Tables and messages.

std::string printed(const Table& table, std::size_t width) {
  std::ostringstream out;
  table.print(out, width);
  return out.str();
}

std::size_t longestLine(const std::string& text) {
  std::istringstream stream(text);
  std::size_t longest = 0;
  for (std::string line; std::getline(stream, line);) longest = std::max(longest, line.size());
  return longest;
}

Table smallTable() {
  Table table({"grid", "max error", "PSNR active"});
  table.add({"density", "0.01", "51.54"});
  return table;
}

TEST(Table, IsPrintedAsItIsWhereItFits) {
  const char* const expected =
      "grid     max error  PSNR active\n"
      "density       0.01        51.54\n";
  EXPECT_EQ(printed(smallTable(), 31), expected);
  std::ostringstream out;
  smallTable().print(out);
  EXPECT_EQ(out.str(), expected);
}

TEST(Table, BreaksItsTitlesWhereItIsTooWide) {
  EXPECT_EQ(printed(smallTable(), 30),
            "           max    PSNR\n"
            "grid     error  active\n"
            "density   0.01   51.54\n");
}

TEST(Table, HasSeveralPartsWhereTitlesOfTwoLinesAreTooWide) {
  EXPECT_EQ(printed(smallTable(), 21),
            "           max\n"
            "grid     error\n"
            "density   0.01\n"
            "\n"
            "           PSNR\n"
            "grid     active\n"
            "density   51.54\n");
}

TEST(Table, GivesALongNameALineOfItsOwn) {
  Table table({"grid", "max error", "PSNR active"});
  const std::string name(25, 'n'), longest = 'a' + std::string(100, 'b') + 'c';
  table.add({name, "1", "40.00"});
  table.add({longest, "2", "41.00"});
  table.add({"heat", "3", "42.00"});
  const std::string text = printed(table, 40);
  EXPECT_LE(longestLine(text), 40u);
  EXPECT_THAT(text, AllOf(HasSubstr('\n' + name + "\n          1   40.00\n"),
                          HasSubstr("\nheat      3   42.00\n"), HasSubstr("\nabbb"),
                          HasSubstr("bbb...bbb"), HasSubstr("bbbc\n"), Not(HasSubstr(longest))));
}

}  // namespace
}  // namespace esvr::cli
