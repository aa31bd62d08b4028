#include "cli/frame_warnings.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace esvr::cli {
namespace {

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
