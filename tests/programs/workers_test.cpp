// Plan: threads take parts of a gate. The parts that are taken at any time must not exceed the whole, except for a part that
// is larger than the whole, which must be alone.
//
// Jobs count their frames. Every frame with an input must be given to one job, and none after a cancellation, a failure
// (if it stops the others) or an exception. Threads with tasks in a random order pass a turnstile. They must pass in the
// order of their numbers, and none after it was closed.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <numeric>
#include <thread>
#include <vector>

#include "esvr/error.h"
#include "programs/resources.h"

namespace esvr::cli {
namespace {

TEST(MemoryGate, NeverGivesMoreThanThereIs) {
  MemoryGate gate(100);
  std::atomic<int> taken{0}, most{0};
  const auto work = [&](int bytes) {
    for (int i = 0; i < 200; ++i) {
      const auto part = gate.take(std::uint64_t(bytes));
      const int now = taken += bytes;
      for (int before = most; before < now && !most.compare_exchange_weak(before, now);) {
      }
      std::this_thread::yield();
      taken -= bytes;
    }
  };
  {
    std::vector<std::jthread> threads;
    for (const int bytes : {10, 30, 40, 60, 100}) threads.emplace_back(work, bytes);
  }
  EXPECT_LE(most, 100);
  EXPECT_EQ(taken, 0);
}

TEST(MemoryGate, LetsTwoTasksInWhereThereIsRoom) {
  MemoryGate gate(100);
  std::atomic<bool> isIn{false};
  std::jthread third;  // ends after the parts are given back
  const auto first = gate.take(60);
  const auto second = gate.take(40);  // would wait forever if there were no room
  third = std::jthread([&] {
    const auto part = gate.take(1);
    isIn = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(isIn);
}

TEST(MemoryGate, LetsATaskInAloneThatNeedsMoreThanThereIs) {
  MemoryGate gate(100);
  std::atomic<bool> isIn{false};
  std::jthread large;
  {
    const auto small = gate.take(1);
    large = std::jthread([&] {
      const auto part = gate.take(1'000'000);
      isIn = true;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_FALSE(isIn);
  }
  large.join();
  EXPECT_TRUE(isIn);
}

std::vector<Frame> hundredFrames() {
  std::vector<Frame> frames(100);
  frames[50].missing = true;
  return frames;
}

TEST(FrameWorkers, GetEveryFrameWithAnInputOnce) {
  const auto frames = framesWithInput(hundredFrames());
  const CancelToken cancel;
  for (const int workers : {1, 4}) {
    std::vector<std::atomic<int>> times(100);
    forEachTask({frames.size(), workers, OnFrameError::kContinue, cancel}, [&](const Task& task) {
      EXPECT_LT(task.worker, workers);
      ++times[frames[task.index]];
      return false;
    });
    for (std::size_t i = 0; i < times.size(); ++i) EXPECT_EQ(times[i], i == 50 ? 0 : 1) << i;
  }
}

/// The frames that one worker begins. \param job  its result for the frame with index 3
std::size_t begunBy(OnFrameError onError, CancelToken& cancel, const std::function<bool()>& third) {
  std::size_t begun = 0;
  forEachTask({99, 1, onError, cancel}, [&](const Task& task) {
    ++begun;
    return task.index == 3 ? third() : true;
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
  const CancelToken cancel;
  for (const int workers : {1, 4})
    EXPECT_THROW(forEachTask({99, workers, OnFrameError::kContinue, cancel},
                             [](const Task&) -> bool { throw BadInput("a frame"); }),
                 BadInput);
}

TEST(FrameWorkers, AreNotMoreThanThreadsOrInputs) {
  EXPECT_EQ(taskWorkers(3, 99), 3);
  EXPECT_EQ(taskWorkers(1000, 99), 99);
  EXPECT_EQ(taskWorkers(8, 2), 2);
  EXPECT_GE(taskWorkers(0, 99), 1);
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
