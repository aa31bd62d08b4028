#pragma once
/// The machine of a test: its devices, its threads, and how often a test repeats what it does with random or damaged input.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstddef>
#include <string>

#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr::test {

/// Selects a device, or lets the running test skip. The caller looks at testing::Test::IsSkipped()
/// where it has more to do.
inline void selectOrSkip(const std::string& name, Device& device) {
  try {
    device = selectDevice(name);
  } catch (const DeviceError& error) {
    GTEST_SKIP() << error.what();
  }
}

class OnGpu : public testing::Test {
 protected:
  void SetUp() override { selectOrSkip("cuda", device_); }
  Device device_;
};

/// A test for every device, see ESVR_ON_DEVICES.
class OnDevice : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override { selectOrSkip(GetParam(), device_); }
  Device device_;
};

}  // namespace esvr::test

/// Skips the running test if no folder of real volumes is configured.
#define ESVR_NEEDS_DATA()     \
  if (*ESVR_DATA_DIR == '\0') \
  GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>"

#define ESVR_ON_DEVICES(Suite)                                             \
  INSTANTIATE_TEST_SUITE_P(Devices, Suite, testing::Values("cpu", "cuda"), \
                           [](const auto& device) { return std::string(device.param); })

namespace esvr::test {

/// \return what `make` returns where at most so many threads work
template <class Make>
auto onThreads(std::size_t threads, const Make& make) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  return make();
}

/// Expects that `make` returns the same on any number of threads.
template <class Make>
void expectSameOnAnyThreads(const Make& make) {
  const auto one = onThreads(1, make);
  for (const std::size_t threads : {2, 5})
    EXPECT_TRUE(onThreads(threads, make) == one) << threads << " threads";
}

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define ESVR_ADDRESS_SANITIZER
#endif
#endif

/// Under the address sanitizer, each trial takes about ten times as long, and the fuzzers try more of them.
#if defined(ESVR_ADDRESS_SANITIZER) || defined(__SANITIZE_ADDRESS__)
inline constexpr std::size_t kFewerTrials = 8;
#else
inline constexpr std::size_t kFewerTrials = 1;
#endif

/// The number of trials of a test that makes `usual` ones in an ordinary build.
constexpr int trials(int usual) { return usual / int(kFewerTrials); }

/// The distance between the bytes that a test damages, if it is `usual` in an ordinary build.
constexpr std::size_t stride(std::size_t usual) {
  return usual * kFewerTrials - (kFewerTrials - 1);
}

}  // namespace esvr::test
