// Plan: folders with some frames. The plan of a sequence has the frames that the options name, and
// treats missing ones as wanted. Outputs are checked before the work begins. Messages and warnings
// name their frames.

#include "programs/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <thread>
#include <vector>

#include "cli/run_program.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

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
