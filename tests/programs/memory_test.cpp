// Plan: threads take parts of a gate. The parts that are taken at any time must not exceed the
// whole, except for a part that is larger than the whole, which must be alone.

#include "programs/memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

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

}  // namespace
}  // namespace esvr::cli
