// Plan: the account limits the bytes of all buffers exactly, also from many threads. A refused
// request changes nothing, and its message says what was refused. Limits are restored. Numbers of
// objects beyond 32 bits are refused by name.

#include "core/cuda/memory_account.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "core/cuda/count32.h"

namespace esvr::cuda {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(MemoryAccount, RefusesWhatGoesBeyondItsLimit) {
  MemoryAccount account;
  account.setLimit(100);
  account.take(60);
  EXPECT_THAT([&] { account.take(41); }, ThrowsMessage<DeviceMemoryError>(HasSubstr("41 bytes")));
  EXPECT_EQ(account.held(), 60u);
  account.take(40);
  account.give(100);
  EXPECT_EQ(account.held(), 0u);
  EXPECT_THROW(account.take(MemoryAccount::kNoLimit), DeviceMemoryError);
}

TEST(MemoryAccount, RefusesAllWhereMoreIsHeldThanTheLimit) {
  MemoryAccount account;
  account.take(60);
  EXPECT_EQ(account.setLimit(50), MemoryAccount::kNoLimit);
  EXPECT_THROW(account.take(1), DeviceMemoryError);
}

TEST(MemoryAccount, CountsFromManyThreads) {
  MemoryAccount account;
  account.setLimit(4000);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int n = 0; n < 10'000; ++n) {
        account.take(1000);
        account.give(1000);
      }
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(account.held(), 0u);
}

TEST(MemoryAccount, LimitsEndWithTheirOwner) {
  {
    const LimitMemory limit(10);
    EXPECT_THROW(memoryAccount().take(11), DeviceMemoryError);
  }
  memoryAccount().take(11);
  memoryAccount().give(11);
}

TEST(MemoryAccount, LimitsOneDevice) {
  const LimitMemory limit(10);
  std::thread other([] {
    accountedDevice() = 1;
    EXPECT_NO_THROW(memoryAccount().take(11));
    memoryAccount().give(11);
    const LimitMemory own(5);
    EXPECT_THROW(memoryAccount().take(6), DeviceMemoryError);
  });
  other.join();
  EXPECT_NO_THROW(memoryAccount().take(10));
  memoryAccount().give(10);
}

TEST(Count32, RefusesByNameWhatKernelsCannotNumber) {
  EXPECT_EQ(count32(4'000'000'000u, "pairs"), 4'000'000'000u);
  EXPECT_EQ(count32(kMaxCount32, "pairs"), kMaxCount32);
  for (const std::size_t n : {kMaxCount32 + 1, std::size_t{1} << 32, (std::size_t{1} << 32) + 5})
    EXPECT_THAT([&] { (void)count32(n, "pairs"); },
                ThrowsMessage<DeviceError>(HasSubstr(std::to_string(n) + " pairs")));
}

}  // namespace
}  // namespace esvr::cuda
