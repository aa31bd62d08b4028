// Plan: threads with tasks in a random order pass a turnstile. They must pass in the order of their
// numbers, and none after it was closed.

#include "cli/turnstile.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <thread>
#include <vector>

namespace esvr::cli {
namespace {

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
