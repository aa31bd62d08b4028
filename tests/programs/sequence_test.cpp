// Plan: the documented examples of fileseq's grammar give the frames that fileseq documents. Texts that are not of the
// grammar are refused with a message that names the option. Each form of a pattern gives the documented name for positive,
// negative, zero and long numbers. The frames on the disk are those whose names the pattern gives, and no others.
//
// Folders with some frames: the plan of a sequence has the frames that the options name, and treats missing ones as wanted.
// Outputs are checked before the work begins. Messages and warnings name their frames.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <thread>
#include <vector>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "programs/sequence.h"

namespace esvr::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

// Frames and the names of their files.

std::vector<FrameNumber> frames(const std::string& text) { return parseFrames("frames", text); }

TEST(FrameRange, IsOneFrameOrAllFromTheFirstToTheLast) {
  EXPECT_THAT(frames("10"), ElementsAre(10));
  EXPECT_THAT(frames("1-5"), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_THAT(frames("5-1"), ElementsAre(5, 4, 3, 2, 1));
  EXPECT_THAT(frames("0"), ElementsAre(0));
}

TEST(FrameRange, MayHaveSteps) {
  EXPECT_THAT(frames("1-10x5"), ElementsAre(1, 6));
  EXPECT_THAT(frames("1-10x2"), ElementsAre(1, 3, 5, 7, 9));
  EXPECT_THAT(frames("10-1x4"), ElementsAre(10, 6, 2));
  EXPECT_THAT(frames("1-10x100"), ElementsAre(1));
  EXPECT_THAT(frames("1-100x5"), SizeIs(20));
}

TEST(FrameRange, MayBeWhatAStepLeavesOut) {
  EXPECT_THAT(frames("1-10y2"), ElementsAre(2, 4, 6, 8, 10));
  EXPECT_THAT(frames("1-9y3"), ElementsAre(2, 3, 5, 6, 8, 9));
  EXPECT_THAT(frames("1-100y5"), SizeIs(80));
}

TEST(FrameRange, MayBeStaggered) {
  EXPECT_THAT(frames("1-10:3"), ElementsAre(1, 4, 7, 10, 3, 5, 9, 2, 6, 8));
  const auto eight = frames("1-100:8");
  EXPECT_THAT(eight, SizeIs(100));
  EXPECT_EQ(eight.front(), 1);
  EXPECT_EQ(eight.back(), 98);
}

TEST(FrameRange, MayBeNegative) {
  EXPECT_THAT(frames("-5--1"), ElementsAre(-5, -4, -3, -2, -1));
  EXPECT_THAT(frames("-1-1"), ElementsAre(-1, 0, 1));
  EXPECT_THAT(frames("1--1"), ElementsAre(1, 0, -1));
  EXPECT_THAT(frames("-10-100"), SizeIs(111));
  EXPECT_THAT(frames("-7"), ElementsAre(-7));
}

TEST(FrameRange, ListHasEveryFrameOnce) {
  EXPECT_THAT(frames("1-3,2-5,9,1"), ElementsAre(1, 2, 3, 4, 5, 9));
  EXPECT_THAT(frames("1-10,10-20"), SizeIs(20));
}

TEST(FrameRange, IsRefusedIfItIsNone) {
  for (const char* text :
       {"", "a", "1-", "-", "1,", ",1", "1,,2", "1-10x", "1-10x0", "1-10x-2", "1-10z2", "1x2",
        "1 2", "1-2-3", "1.5", "+1", "1-10y1", "99999999999999999999", "1-1000000000000000000"})
    EXPECT_THROW((void)frames(text), UsageError) << text;
  try {
    (void)frames("1-x");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), test::Says("--frames", "1-x"));
  }
}

TEST(FrameRange, HasAMillionFramesAtMost) {
  EXPECT_THAT(frames("1-1000000"), SizeIs(1'000'000));
  for (const char* text : {"1-1000001", "1-999999999999999", "1-999999999999999y7",
                           "1-999999999999999:999999999999999"})
    EXPECT_THROW((void)frames(text), UsageError) << text;
}

TEST(FrameRange, IsTextWithRanges) {
  EXPECT_EQ(textOfFrames({4}), "4");
  EXPECT_EQ(textOfFrames({-2, -1, 0, 7, 9, 10}), "-2-0, 7, 9-10");
  EXPECT_EQ(textOfFrames({1, 3, 5, 7, 9, 11, 13, 15, 17, 19}),
            "1, 3, 5, 7, 9, 11, 13, 15 and 2 more");
}

std::string pathOf(const std::string& pattern, FrameNumber frame) {
  return FramePattern::in(pattern)->at(frame).string();
}

struct Name {
  const char* pattern;
  FrameNumber frame;
  const char* path;
};
std::ostream& operator<<(std::ostream& out, const Name& name) { return out << name.pattern; }

class FrameName : public testing::TestWithParam<Name> {};

TEST_P(FrameName, HasTheDigitsOfThePattern) {
  EXPECT_EQ(pathOf(GetParam().pattern, GetParam().frame), GetParam().path);
}

INSTANTIATE_TEST_SUITE_P(
    Forms, FrameName,
    testing::Values(Name{"a.#.vdb", 7, "a.0007.vdb"}, Name{"a.##.vdb", 7, "a.07.vdb"},
                    Name{"a.####.vdb", 7, "a.0007.vdb"}, Name{"a.@.vdb", 7, "a.7.vdb"},
                    Name{"a.@@@.vdb", 7, "a.007.vdb"}, Name{"a.%04d.vdb", 7, "a.0007.vdb"},
                    Name{"a.%01d.vdb", 7, "a.7.vdb"}, Name{"a.%d.vdb", 7, "a.7.vdb"},
                    Name{"a.$F4.vdb", 7, "a.0007.vdb"}, Name{"a.$F.vdb", 7, "a.7.vdb"},
                    Name{"a.############.vdb", 7, "a.000000000007.vdb"},
                    Name{"a.%012d.vdb", 123456789012, "a.123456789012.vdb"}));
INSTANTIATE_TEST_SUITE_P(Numbers, FrameName,
                         testing::Values(Name{"a####", 0, "a0000"}, Name{"a####", -5, "a-005"},
                                         Name{"a@", -5, "a-5"}, Name{"a####", 12345, "a12345"},
                                         Name{"a####", -12345, "a-12345"}));
INSTANTIATE_TEST_SUITE_P(Places, FrameName,
                         testing::Values(Name{"####", 7, "0007"},
                                         Name{"take#2/me@home/a.##.vdb", 7,
                                              "take#2/me@home/a.07.vdb"},
                                         Name{"a.####", 7, "a.0007"}));

TEST(FramePattern, IsNoneInOtherNames) {
  for (const char* name : {"smoke.vdb", "smoke.0007.vdb", "100%.vdb", "$G4.vdb", "F4.vdb",
                           "f.####/a.vdb", "100%d/a.vdb", ""})
    EXPECT_FALSE(FramePattern::in(name)) << name;
}

TEST(FramePattern, HasAReasonableNumberOfDigits) {
  EXPECT_EQ(pathOf("%032d", 1).size(), 32u);
  for (const char* name : {"%033d", "%099999999999999999999d", "$F33"})
    EXPECT_THROW((void)FramePattern::in(name), UsageError) << name;
}

class FramesOnDisk : public test::FolderTest {
 protected:
  [[nodiscard]] FramePattern pattern(const std::string& name) const {
    return *FramePattern::in(at(name));
  }
  void write(const std::string& name) const { test::writeText(at(name), ""); }
};

TEST_F(FramesOnDisk, AreInOrderOfTheirNumbers) {
  for (const char* name : {"a.0010.vdb", "a.0002.vdb", "a.-001.vdb", "a.12345.vdb", "a.0000.vdb"})
    write(name);
  EXPECT_THAT(pattern("a.####.vdb").onDisk().frames, ElementsAre(-1, 0, 2, 10, 12345));
}

TEST_F(FramesOnDisk, HaveNamesThatThePatternGives) {
  for (const char* name : {"a.1.vdb", "a.0001.vdb", "a.00002.vdb", "a.-0003.vdb", "a.0004.vdb.bak",
                           "aa.0005.vdb", "a.0x06.vdb", "a..vdb", "a.+007.vdb", "a.-000.vdb",
                           "a.99999999999999999999.vdb", "a.-9223372036854775808.vdb"})
    write(name);
  EXPECT_THAT(pattern("a.####.vdb").onDisk().frames, ElementsAre(-3, 1)) << "-3 as Blender has it";
  EXPECT_THAT(pattern("a.@.vdb").onDisk().frames, ElementsAre(1));
  EXPECT_THAT(pattern("a.@@@@@.vdb").onDisk().frames, ElementsAre(-3, 2));
  EXPECT_THAT(pattern("b.#.vdb").onDisk().frames, IsEmpty());
  EXPECT_THAT(pattern("no/folder/a.#.vdb").onDisk().frames, IsEmpty());
}

TEST_F(FramesOnDisk, MayBeInFoldersOfTheirOwn) {
  std::filesystem::create_directories(at("f01"));
  std::filesystem::create_directories(at("f02"));
  write("f02/a.vdb");
  const auto pattern = FramePattern::ofInput(at("f##/a.vdb"));
  ASSERT_TRUE(pattern);
  EXPECT_THAT(pattern->onDisk().frames, ElementsAre(2)) << "f01 has no file";
  EXPECT_EQ(pattern->at(2), at("f02/a.vdb"));
}

TEST_F(FramesOnDisk, AreNotThoseOfAFolderThatExists) {
  for (const char* folder : {"render@farm", "Take #2", "C#", "100%d", "$F"}) {
    std::filesystem::create_directories(at(folder));
    const std::string path = at(folder) + "/a";
    EXPECT_FALSE(FramePattern::ofInput(path + ".vdb")) << folder;
    EXPECT_EQ(FramePattern::ofInput(path + ".##.vdb")->at(7), path + ".07.vdb");
    EXPECT_EQ(FramePattern::ofInput(path + "##/b.vdb")->at(7), path + "07/b.vdb");
  }
  std::filesystem::create_directories(at("f##/C#"));
  EXPECT_FALSE(FramePattern::ofInput(at("f##/C#/a.vdb")));
}

TEST_F(FramesOnDisk, AreNotThoseOfAFileThatExists) {
  write("take#2.vdb");
  EXPECT_FALSE(FramePattern::ofInput(at("take#2.vdb")));
  EXPECT_TRUE(FramePattern::ofInput(at("take#3.vdb")));
}

TEST_F(FramesOnDisk, WithOtherDigitsAreTold) {
  EXPECT_EQ(pattern("a.#.vdb").onDisk().hint(), "");
  for (const char* name : {"a.1.vdb", "a.2.vdb", "a.9.vdb", "a.10.vdb", "a.11.vdb"}) write(name);
  const FrameListing listing = pattern("a.##.vdb").onDisk();
  EXPECT_THAT(listing.frames, ElementsAre(10, 11));
  EXPECT_THAT(listing.others, ElementsAre(1, 2, 9));
  EXPECT_EQ(listing.exampleOfOthers, at("a.1.vdb"));
  EXPECT_EQ(listing.patternOfAll, at("a.@.vdb"));
  EXPECT_THAT(listing.hint(), HasSubstr("1-2, 9 look like frames and are none"));
  const std::vector<FrameNumber> wanted{9, 10};
  EXPECT_THAT(listing.hint(&wanted), HasSubstr("9 looks like a frame and is none"));
  const std::vector<FrameNumber> complete{10, 11};
  EXPECT_EQ(listing.hint(&complete), "");
  write("a.0012.vdb");
  EXPECT_EQ(pattern("a.##.vdb").onDisk().patternOfAll, "") << "no pattern takes 1 and 0012";
}

TEST_F(FramesOnDisk, HaveTheFormOfBlenderWhereTheOtherIsAbsent) {
  for (const char* name : {"a_-0002.vdb", "a_-0001.vdb", "a_-001.vdb", "a_0000.vdb"}) write(name);
  const FramePattern blender = pattern("a_####.vdb");
  const FrameListing listing = blender.onDisk();
  EXPECT_THAT(listing.frames, ElementsAre(-2, -1, 0));
  EXPECT_THAT(listing.others, ElementsAre(-1)) << "a_-0001.vdb, beside a_-001.vdb";
  EXPECT_EQ(blender.toRead(-2), at("a_-0002.vdb"));
  EXPECT_EQ(blender.toRead(-1), at("a_-001.vdb"));
  EXPECT_EQ(blender.toRead(-3), at("a_-003.vdb"));
  EXPECT_EQ(blender.at(-2), at("a_-002.vdb")) << "as outputs are written";
}

TEST_F(FramesOnDisk, AreNoSubstepsAndHaveNoHugeNumbers) {
  for (const char* name : {"a.1001.vdb", "a.1001.50.vdb", "a.1002.50.vdb"}) write(name);
  const FrameListing listing = pattern("a.####.vdb").onDisk();
  EXPECT_THAT(listing.frames, ElementsAre(1001));
  EXPECT_EQ(listing.substeps, 2u);
  EXPECT_EQ(listing.patternOfSubsteps, at("a.####.50.vdb"));
  EXPECT_THAT(listing.hint(), HasSubstr("a.1001.50.vdb and 1 more look like a substep of Houdini"));
  EXPECT_THAT(pattern("a.####.50.vdb").onDisk().frames, ElementsAre(1001, 1002));
  write("b.1.vdb"), write("b.99999999999999999999.vdb");
  EXPECT_THAT(pattern("b.@.vdb").onDisk().hint(), HasSubstr("too large for a frame"));
}

// Sequences.

class SequencePlan : public test::FolderTest {
 protected:
  void write(const std::string& name) const { test::writeText(at(name), ""); }
  void writeFrames(const std::vector<FrameNumber>& numbers) const {
    for (const FrameNumber number : numbers) write("a." + std::to_string(number) + ".vdb");
  }
  [[nodiscard]] Sequence sequence() const {
    return {.input = *FramePattern::in(at("a.@.vdb")),
            .output = *FramePattern::in(at("b.##.esvr"))};
  }
  [[nodiscard]] std::vector<Frame> plan(std::vector<FrameNumber> frames,
                                        MissingFrame missing) const {
    Sequence wanted = sequence();
    wanted.frames = std::move(frames);
    wanted.missing = missing;
    return planFrames(wanted, log());
  }
  /// Notes the warnings.
  [[nodiscard]] Log log() const {
    return {"program", Verbosity::kNormal,
            [this](const std::string& text) { warnings_.push_back(text); }};
  }
  template <class Refused>
  static void expectRefused(const std::function<void()>& action, const char* words) {
    try {
      action();
      ADD_FAILURE() << "not refused: " << words;
    } catch (const Refused& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }
  mutable std::vector<std::string> warnings_;
};

std::vector<FrameNumber> numbersOf(const std::vector<Frame>& frames) {
  std::vector<FrameNumber> numbers;
  for (const Frame& frame : frames) numbers.push_back(frame.number);
  return numbers;
}

TEST_F(SequencePlan, HasAllFramesOnTheDiskUnlessSomeAreNamed) {
  writeFrames({3, 1, 20});
  EXPECT_THAT(numbersOf(planFrames(sequence(), log())), ElementsAre(1, 3, 20));
  const auto frames = plan({20, 1}, MissingFrame::kError);
  EXPECT_THAT(numbersOf(frames), ElementsAre(20, 1)) << "in the order in which they are named";
  EXPECT_EQ(frames[1].input, at("a.1.vdb"));
  EXPECT_EQ(frames[1].output, at("b.01.esvr"));
}

TEST_F(SequencePlan, NamesWhatDoesNotMatch) {
  expectRefused<BadInput>([&] { (void)planFrames(sequence(), log()); }, "no file matches");
  write("a.0001.vdb");
  expectRefused<BadInput>([&] { (void)planFrames(sequence(), log()); },
                          "a.0001.vdb has another number");
}

TEST_F(SequencePlan, TellsWhatLooksLikeFrames) {
  writeFrames({1, 2, 3});
  (void)planFrames(sequence(), log());
  EXPECT_THAT(warnings_, testing::IsEmpty());
  write("a.0007.vdb");
  EXPECT_THAT(numbersOf(planFrames(sequence(), log())), ElementsAre(1, 2, 3));
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("7 looks like a frame and is none")));
  warnings_.clear();
  (void)plan({1, 2}, MissingFrame::kError);
  EXPECT_THAT(warnings_, testing::IsEmpty()) << "7 is not wanted";
  expectRefused<BadInput>(
      [&] {
        (void)plan({1, 7}, MissingFrame::kError);
      },
      "repeats the frame before); 7 looks like a frame");
}

TEST_F(SequencePlan, ReadsTheNegativeFramesOfBlender) {
  for (const char* name : {"f_-0002.vdb", "f_-0001.vdb", "f_0000.vdb"}) write(name);
  const Sequence wanted{.input = *FramePattern::in(at("f_####.vdb")),
                        .output = *FramePattern::in(at("b.##.esvr"))};
  const auto frames = planFrames(wanted, log());
  EXPECT_THAT(numbersOf(frames), ElementsAre(-2, -1, 0));
  EXPECT_EQ(frames[0].input, at("f_-0002.vdb"));
  EXPECT_THAT(warnings_, testing::IsEmpty());
}

TEST_F(SequencePlan, RefusesMissingFramesUnlessToldWhatToDo) {
  writeFrames({1, 4});
  expectRefused<BadInput>(
      [&] {
        (void)plan({1, 2, 3, 4, 6}, MissingFrame::kError);
      },
      "frames 2-3, 6 are missing (--missing skip");
  expectRefused<BadInput>([&] { (void)plan({1, 2}, MissingFrame::kError); }, "frame 2 is missing");
}

TEST_F(SequencePlan, SkipsMissingFrames) {
  writeFrames({1, 4});
  const auto frames = plan({1, 2, 4}, MissingFrame::kSkip);
  EXPECT_FALSE(frames[0].missing);
  EXPECT_TRUE(frames[1].missing && !frames[1].holds);
  expectRefused<BadInput>([&] { (void)plan({2, 3}, MissingFrame::kSkip); }, "no other frame");
}

TEST_F(SequencePlan, HoldsTheFrameBefore) {
  writeFrames({1, 2, 4});
  const auto frames = plan({6, 4, 1, 3}, MissingFrame::kHold);
  EXPECT_EQ(frames[0].holds, 1u) << "6 holds 4";
  EXPECT_FALSE(frames[1].holds);
  EXPECT_EQ(frames[3].holds, 2u) << "3 holds 1, because 2 was not named";
  expectRefused<BadInput>(
      [&] {
        (void)plan({0, 1}, MissingFrame::kHold);
      },
      "frame 0 is missing, and no frame before it");
}

using SequenceOutput = SequencePlan;

TEST_F(SequenceOutput, MustNotExistUnlessItMay) {
  writeFrames({1, 2, 3});
  const auto frames = planFrames(sequence(), log());
  const auto check = [&](bool mayExist) {
    checkFrameOutputs(sequence(), frames, {{".esvr"}, mayExist});
  };
  EXPECT_NO_THROW(check(false));
  write("b.02.esvr");
  expectRefused<RuntimeFailure>([&] { check(false); }, "b.02.esvr: it exists already;");
  write("b.03.esvr");
  expectRefused<RuntimeFailure>([&] { check(false); }, "other frames (2-3); --force");
  EXPECT_NO_THROW(check(true));
}

TEST_F(SequenceOutput, NeedsItsExtensionAndAFolder) {
  writeFrames({1});
  Sequence wanted = sequence();
  const auto check = [&](const char* output) {
    wanted.output = *FramePattern::in(at(output));
    checkFrameOutputs(wanted, planFrames(wanted, log()), {{".esvr"}, false});
  };
  expectRefused<UsageError>([&] { check("b.#.png"); }, "must end in .esvr");
  expectRefused<RuntimeFailure>([&] { check("no/b.#.esvr"); }, "there is no folder");
  expectRefused<UsageError>([&] { check("a.@.vdb"); }, "are one file");
}

TEST(FrameMessages, NameTheFrames) {
  EXPECT_EQ(textOf(Frame{.number = -7}), "frame -7");
  EXPECT_EQ(sentenceOn({1, 2, 3, 9}, 100, "failed"), "4 of 100 frames failed: 1-3, 9");
}

TEST(FrameMessages, KeepTheKindOfTheFailureOfAHeldFrame) {
  const Error error = failureToHold(Frame{.number = 7}, BadInput("damaged"));
  EXPECT_EQ(error.kind(), ErrorKind::kBadInput);
  EXPECT_STREQ(error.what(), "frame 7, which it holds, failed");
}

std::string toldTo(Verbosity verbosity, const FrameWarnings& warnings) {
  testing::internal::CaptureStderr();
  warnings.tell(Log("prog", verbosity));
  return testing::internal::GetCapturedStderr();
}

TEST(FrameWarnings, AreToldOnceWithTheirFrames) {
  FrameWarnings warnings;
  std::vector<std::thread> threads;
  for (const FrameNumber number : {3, 1, 2, 7})
    threads.emplace_back([&warnings, number] {
      const Log log = warnings.logOf(Frame{.number = number}, "prog", Verbosity::kNormal);
      log.warning("the memory was full", std::to_string(number) + " ellipsoids");
      if (number == 7) log.warning("another");
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(toldTo(Verbosity::kNormal, warnings),
            "prog: warning: frame 7: another\n"
            "prog: warning: frames 1-3, 7: the memory was full\n");
  EXPECT_EQ(toldTo(Verbosity::kQuiet, warnings), "");
}

TEST(FrameWarnings, NameAFrameOnceThatWarnsTwice) {
  FrameWarnings warnings;
  warnings.add(5, "again");
  warnings.add(5, "again");
  EXPECT_EQ(toldTo(Verbosity::kNormal, warnings), "prog: warning: frame 5: again\n");
}

TEST(Log, PrintsTheFigureOfAWarning) {
  testing::internal::CaptureStderr();
  Log("prog", Verbosity::kNormal).warning("voxels were replaced", "2 voxels");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "prog: warning: voxels were replaced (2 voxels)\n");
}

}  // namespace
}  // namespace esvr::cli
