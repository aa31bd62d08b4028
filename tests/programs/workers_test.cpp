// Plan: jobs count their frames. Every frame with an input must be given to one job, and none
// after a cancellation, a failure (if it stops the others) or an exception. Threads with tasks in
// a random order pass a turnstile. They must pass in the order of their numbers, and none after it
// was closed.

#include "programs/workers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <numeric>
#include <thread>
#include <vector>

#include "esvr/error.h"

namespace esvr::cli {
namespace {

std::vector<Frame> hundredFrames() {
  std::vector<Frame> frames(100);
  frames[50].missing = true;
  return frames;
}

TEST(FrameWorkers, GetEveryFrameWithAnInputOnce) {
  const auto frames = hundredFrames();
  const CancelToken cancel;
  for (const int workers : {1, 4}) {
    std::vector<std::atomic<int>> times(frames.size());
    forEachFrame({frames, workers, OnFrameError::kContinue, cancel}, [&](const FrameTask& task) {
      EXPECT_LT(task.worker, workers);
      ++times[task.frame];
      return false;
    });
    for (std::size_t i = 0; i < times.size(); ++i) EXPECT_EQ(times[i], i == 50 ? 0 : 1) << i;
  }
}

/// The frames that one worker begins. \param job  its result for the frame with index 3
std::size_t begunBy(OnFrameError onError, CancelToken& cancel, const std::function<bool()>& third) {
  std::size_t begun = 0;
  const auto frames = hundredFrames();
  forEachFrame({frames, 1, onError, cancel}, [&](const FrameTask& task) {
    ++begun;
    return task.frame == 3 ? third() : true;
  });
  return begun;
}

TEST(FrameWorkers, StopAfterAFailureWhereAsked) {
  CancelToken cancel;
  EXPECT_EQ(begunBy(OnFrameError::kStop, cancel, [] { return false; }), 4u);
  EXPECT_EQ(begunBy(OnFrameError::kContinue, cancel, [] { return false; }), 99u);
}

TEST(FrameWorkers, StopAfterACancellation) {
  CancelToken cancel;
  const auto begun = begunBy(OnFrameError::kContinue, cancel, [&] {
    cancel.cancel();
    return true;
  });
  EXPECT_EQ(begun, 4u);
}

TEST(FrameWorkers, PassOnAnException) {
  const auto frames = hundredFrames();
  const CancelToken cancel;
  for (const int workers : {1, 4})
    EXPECT_THROW(forEachFrame({frames, workers, OnFrameError::kContinue, cancel},
                              [](const FrameTask&) -> bool { throw BadInput("a frame"); }),
                 BadInput);
}

TEST(FrameWorkers, AreNotMoreThanThreadsOrInputs) {
  EXPECT_EQ(frameWorkers(3, hundredFrames()), 3);
  EXPECT_EQ(frameWorkers(1000, hundredFrames()), 99);
  EXPECT_EQ(frameWorkers(8, std::vector<Frame>(2)), 2);
  EXPECT_GE(frameWorkers(0, hundredFrames()), 1);
}

TEST(Turnstile, IsPassedInTheOrderOfTheTasks) {
  Turnstile turnstile;
  std::vector<std::size_t> passed;  // guarded by the turnstile
  {
    std::vector<std::jthread> threads;
    for (const std::size_t task : {3u, 0u, 4u, 2u, 1u})
      threads.emplace_back([&, task] {
        ASSERT_TRUE(turnstile.await(task));
        passed.push_back(task);
        turnstile.pass();
      });
  }
  std::vector<std::size_t> expected(5);
  std::iota(expected.begin(), expected.end(), 0u);
  EXPECT_EQ(passed, expected);
}

TEST(Turnstile, LetsNoTaskPassAfterItIsClosed) {
  Turnstile turnstile;
  std::atomic<int> refused{0};
  {
    std::vector<std::jthread> threads;
    for (const std::size_t task : {2u, 3u})
      threads.emplace_back([&, task] { refused += !turnstile.await(task); });
    ASSERT_TRUE(turnstile.await(0));
    turnstile.pass();
    ASSERT_TRUE(turnstile.await(1));
    turnstile.close();
  }
  EXPECT_EQ(refused, 2);
}

}  // namespace
}  // namespace esvr::cli
