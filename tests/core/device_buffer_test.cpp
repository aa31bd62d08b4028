// Plan: errors of the runtime are exceptions with their place. Buffers say how much was
// asked for when memory is out. The account limits the bytes of all buffers exactly, also from many threads. A refused
// request changes nothing, and its message says what was refused. A share counts and limits the
// buffers of one thread, whichever share ends first. Numbers of
// objects beyond 32 bits are refused by name.

#include "core/cuda/device_buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <barrier>
#include <memory>
#include <optional>
#include <thread>
#include <type_traits>
#include <vector>

#include "core/cuda/runtime.h"
#include "support/machine.h"
#include "support/messages.h"

namespace esvr::cuda {
namespace {

static_assert(!std::is_copy_constructible_v<DeviceBuffer<float>>);
static_assert(!std::is_copy_assignable_v<DeviceBuffer<float>>);
static_assert(std::is_nothrow_move_constructible_v<DeviceBuffer<float>>);

TEST(Check, PassesSuccessAndThrowsCudasOwnTextWithThePlace) {
  EXPECT_NO_THROW(check(cudaSuccess, "adding"));
  EXPECT_THAT([] { check(cudaErrorInvalidValue, "adding"); },
              test::ThrowsSaying<DeviceError>("adding", "invalid argument", "cudaErrorInvalidValue",
                                              "device_buffer_test.cpp:"));
}

TEST(DeviceBuffer, OfNoElementsNeedsNoDevice) {
  DeviceBuffer<float> buffer(0, nullptr);
  EXPECT_EQ(buffer.data(), nullptr);
  EXPECT_EQ(buffer.size(), 0u);
}

class DeviceBufferOnGpu : public test::OnGpu {
 protected:
  void SetUp() override {
    OnGpu::SetUp();
    if (!IsSkipped()) stream.emplace();
  }
  std::optional<Stream> stream;
};

TEST_F(DeviceBufferOnGpu, SaysHowMuchWasAskedForWhenMemoryIsOut) {
  // No device has 2^50 bytes, and 2^63 elements of 8 bytes exceed size_t.
  for (const std::size_t n : {std::size_t{1} << 47, std::size_t{1} << 63})
    EXPECT_THAT([&] { DeviceBuffer<double>(n, stream->get()); },
                test::ThrowsSaying<DeviceError>(std::to_string(n) + " times 8 bytes"));
  // Later calls must not report this failure again.
  EXPECT_NO_THROW(check(cudaGetLastError(), "nothing"));
}

// The account.

TEST(MemoryAccount, RefusesWhatGoesBeyondItsLimit) {
  MemoryAccount account;
  account.setLimit(100);
  account.take(60);
  EXPECT_THAT([&] { account.take(41); }, test::ThrowsSaying<DeviceMemoryError>("41 bytes"));
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

TEST(MemoryAccount, OfAPartIsLimitedByTheWholeToo) {
  MemoryAccount whole;
  whole.setLimit(100);
  MemoryAccount part(whole), other(whole);
  part.setLimit(80);
  EXPECT_THROW(part.take(81), DeviceMemoryError);
  part.take(70);
  EXPECT_THROW(other.take(31), DeviceMemoryError);
  EXPECT_EQ(other.held(), 0u);
  other.take(30);
  EXPECT_EQ(whole.held(), 100u);
  part.give(70);
  other.give(30);
  EXPECT_EQ(whole.held(), 0u);
  EXPECT_EQ(part.peak(), 70u);
  EXPECT_EQ(whole.peak(), 100u);
}

TEST(MemoryShare, EndsWithItsOwner) {
  {
    const MemoryShare share(10);
    EXPECT_THROW(memoryAccount().take(11), DeviceMemoryError);
  }
  memoryAccount().take(11);
  memoryAccount().give(11);
}

TEST(MemoryShare, IsThatOfOneDevice) {
  const MemoryShare share(10);
  accountedDevice() = 1;
  EXPECT_NO_THROW(memoryAccount().take(11));
  memoryAccount().give(11);
  {
    const MemoryShare own(5);
    EXPECT_THROW(memoryAccount().take(6), DeviceMemoryError);
  }
  accountedDevice() = 0;
  EXPECT_NO_THROW(memoryAccount().take(10));
  memoryAccount().give(10);
}

TEST(MemoryShare, DoesNotDependOnWhichOfSeveralEndsFirst) {
  auto first = std::make_unique<MemoryShare>(10);
  auto second = std::make_unique<MemoryShare>(20);
  memoryAccount().take(15);
  first.reset();
  EXPECT_THROW(memoryAccount().take(6), DeviceMemoryError);
  memoryAccount().give(15);
  EXPECT_EQ(second->peak(), 15u);
  second.reset();
  EXPECT_NO_THROW(memoryAccount().take(21));
  memoryAccount().give(21);
  EXPECT_EQ(deviceAccount().held(), 0u);
}

// Two fits that overlap, the first of which ends first.
TEST(MemoryShare, OfOneThreadKnowsNothingOfThoseOfOthers) {
  std::barrier both(2);
  const auto fit = [&](std::size_t limit, bool endsFirst) {
    {
      const MemoryShare share(limit);
      both.arrive_and_wait();
      memoryAccount().take(limit);
      EXPECT_THROW(memoryAccount().take(1), DeviceMemoryError);
      both.arrive_and_wait();
      EXPECT_EQ(share.peak(), limit);
      if (!endsFirst) both.arrive_and_wait();  // the other share has ended
      EXPECT_THROW(memoryAccount().take(1), DeviceMemoryError);
      memoryAccount().give(limit);
    }
    if (endsFirst) both.arrive_and_wait();
    EXPECT_NO_THROW(memoryAccount().take(100));  // no limit is left
    memoryAccount().give(100);
  };
  std::thread other([&] { fit(30, true); });
  fit(50, false);
  other.join();
  EXPECT_EQ(deviceAccount().held(), 0u);
}

TEST(Count32, RefusesByNameWhatKernelsCannotNumber) {
  EXPECT_EQ(count32(4'000'000'000u, "pairs"), 4'000'000'000u);
  EXPECT_EQ(count32(kMaxCount32, "pairs"), kMaxCount32);
  for (const std::size_t n : {kMaxCount32 + 1, std::size_t{1} << 32, (std::size_t{1} << 32) + 5})
    EXPECT_THAT([&] { (void)count32(n, "pairs"); },
                test::ThrowsSaying<DeviceError>(std::to_string(n) + " pairs"));
}

}  // namespace
}  // namespace esvr::cuda
