// Plan: texts name devices, and devices that cannot be used are refused with the reason.
//
// A token for a part of a call is cancelled with the whole call, but not the other way round. A
// scope gives a thread its token and the tasks of a loop that of the thread that began it, and ends these
// loops. In a completion, loops are not cancelled.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "core/device_choice.h"
#include "core/parallel.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "support/messages.h"

namespace esvr {
namespace {

using testing::ElementsAre;
using testing::StartsWith;

// Devices.

CudaProbe noGpu() { return {.versions = {}, .devices = {}, .whyNoDevices = "no driver"}; }

/// Device 0 is too old for the build; devices 1 and 2 are usable.
CudaProbe threeGpus() {
  return {.versions = {},
          .devices = {{0, "Old", "too old"}, {1, "New", ""}, {2, "Newer", ""}},
          .whyNoDevices = {}};
}

CudaProbe onlyAnOldGpu() {
  return {.versions = {}, .devices = {{0, "Old", "too old"}}, .whyNoDevices = {}};
}

TEST(FreeDeviceMemory, IsNoneOnTheCpu) { EXPECT_EQ(freeDeviceMemory(Device{}), 0u); }

TEST(ChooseDevice, CpuIsTheCpuWhateverThereIs) {
  EXPECT_EQ(chooseDevice("cpu", threeGpus()).kind, DeviceKind::kCpu);
  EXPECT_EQ(chooseDevice("cpu", noGpu()).kind, DeviceKind::kCpu);
}

TEST(ChooseDevice, AutoTakesTheFirstUsableDevice) {
  const auto device = chooseDevice("auto", threeGpus());
  EXPECT_EQ(device.kind, DeviceKind::kCuda);
  EXPECT_EQ(device.index, 1);
}

TEST(ChooseDevice, AutoFallsBackToTheCpuWhereNoDeviceIsUsable) {
  EXPECT_EQ(chooseDevice("auto", noGpu()).kind, DeviceKind::kCpu);
  EXPECT_EQ(chooseDevice("auto", onlyAnOldGpu()).kind, DeviceKind::kCpu);
}

TEST(ChooseDevice, CudaTakesTheFirstUsableDeviceOrSaysWhyThereIsNone) {
  EXPECT_EQ(chooseDevice("cuda", threeGpus()).index, 1);
  EXPECT_THAT([] { (void)chooseDevice("cuda", noGpu()); },
              test::ThrowsSaying<DeviceError>("no driver"));
  EXPECT_THAT([] { (void)chooseDevice("cuda", onlyAnOldGpu()); },
              test::ThrowsSaying<DeviceError>("Old", "too old"));
}

TEST(ChooseDevice, CudaWithANumberTakesThatDeviceOrNone) {
  EXPECT_EQ(chooseDevice("cuda:2", threeGpus()).index, 2);
  EXPECT_THAT([] { (void)chooseDevice("cuda:0", threeGpus()); },
              test::ThrowsSaying<DeviceError>("too old"));
  EXPECT_THAT([] { (void)chooseDevice("cuda:3", threeGpus()); },
              test::ThrowsSaying<DeviceError>("there are 3"));
  EXPECT_THAT([] { (void)chooseDevice("cuda:0", noGpu()); },
              test::ThrowsSaying<DeviceError>("no driver"));
}

std::vector<int> indicesOf(const std::string& text) {
  std::vector<int> indices;
  for (const Device& device : chooseDevices(text, threeGpus())) indices.push_back(device.index);
  return indices;
}

TEST(ChooseDevices, TakesTheDevicesOfAList) {
  EXPECT_THAT(indicesOf("cuda:2,1,2"), ElementsAre(2, 1, 2));
  EXPECT_THAT(indicesOf("cuda:all"), ElementsAre(1, 2));
  EXPECT_THAT(indicesOf("cuda:2"), ElementsAre(2));
  EXPECT_THAT(indicesOf("cuda"), ElementsAre(1));
  EXPECT_EQ(chooseDevices("cpu", threeGpus()).size(), 1u);
}

TEST(ChooseDevices, SaysWhichDeviceOfAListIsMissing) {
  EXPECT_THAT([] { (void)chooseDevices("cuda:1,3", threeGpus()); },
              test::ThrowsSaying<DeviceError>("no cuda:3"));
  EXPECT_THAT([] { (void)chooseDevices("cuda:all", noGpu()); },
              test::ThrowsSaying<DeviceError>("no driver"));
  for (const char* text : {"cuda:1,", "cuda:,1", "cuda:1;2", "cuda:all,1"})
    EXPECT_THROW((void)chooseDevices(text, threeGpus()), UsageError) << text;
}

class MeaninglessDevice : public testing::TestWithParam<const char*> {};

TEST_P(MeaninglessDevice, IsAUsageErrorThatNamesIt) {
  EXPECT_THAT([] { (void)chooseDevice(GetParam(), threeGpus()); },
              test::ThrowsSaying<UsageError>("'" + std::string(GetParam()) + "'"));
}

INSTANTIATE_TEST_SUITE_P(Texts, MeaninglessDevice,
                         testing::Values("", "gpu", "CPU", "cpu ", "cuda:", "cuda:-1", "cuda:x",
                                         "cuda:1x", "cuda: 1", "cuda:+1",
                                         "cuda:99999999999999999999"));

// The machine that runs the tests may or may not have a GPU and a driver.

TEST(SelectDevice, WorksOnAnyMachine) {
  EXPECT_EQ(selectDevice("cpu").kind, DeviceKind::kCpu);
  const bool usable = selectDevice("auto").kind == DeviceKind::kCuda;
  EXPECT_TRUE(builtWithCuda() || !usable);
  if (usable)
    EXPECT_EQ(selectDevice("cuda").kind, DeviceKind::kCuda);
  else
    EXPECT_THROW((void)selectDevice("cuda"), DeviceError);
}

TEST(CudaVersions, SaysWhatTheBuildHas) {
  EXPECT_THAT(cudaVersions(), StartsWith(builtWithCuda() ? "CUDA 1" : "no CUDA"));
}

// Cancellation.

TEST(CancelToken, OfAPartIsCancelledWithTheWhole) {
  CancelToken whole;
  const CancelToken part(&whole);
  EXPECT_FALSE(part.cancelled());
  whole.cancel();
  EXPECT_TRUE(part.cancelled());
}

TEST(CancelToken, OfAPartDoesNotCancelTheWhole) {
  CancelToken whole;
  CancelToken part(&whole);
  part.cancel();
  EXPECT_TRUE(part.cancelled());
  EXPECT_FALSE(whole.cancelled());
}

TEST(CancelToken, OfAPartNeedsNoWhole) {
  CancelToken part(nullptr);
  EXPECT_FALSE(part.cancelled());
  part.cancel();
  EXPECT_TRUE(part.cancelled());
}

TEST(CancelScope, IsThatOfItsThreadUntilItEnds) {
  CancelToken outer, inner;
  EXPECT_EQ(CancelScope::token(), nullptr);
  {
    const CancelScope first(&outer);
    EXPECT_EQ(CancelScope::token(), &outer);
    EXPECT_EQ(CancelScope::orToken(nullptr), &outer);
    EXPECT_EQ(CancelScope::orToken(&inner), &inner);
    {
      const CancelScope second(&inner);
      inner.cancel();
      EXPECT_THROW(CancelScope::check(), Cancelled);
      std::thread([] { EXPECT_EQ(CancelScope::token(), nullptr); }).join();
    }
    EXPECT_NO_THROW(CancelScope::check());
  }
  EXPECT_EQ(CancelScope::token(), nullptr);
}

TEST(CancelScope, IsThatOfAllTasksOfALoop) {
  CancelToken token;
  const CancelScope scope(&token);
  std::atomic<int> done = 0;
  const auto count = [&](int i) {
    EXPECT_EQ(CancelScope::token(), &token);
    if (++done == 10) token.cancel();
    parallelFor(0, 2, [&](int) { EXPECT_EQ(CancelScope::token(), &token); });
    (void)i;
  };
  EXPECT_THROW(parallelFor(0, 1'000'000, count), Cancelled);
  EXPECT_LT(done, 1000);
}

TEST(CancelScope, EndsReductions) {
  CancelToken token;
  token.cancel();
  const CancelScope scope(&token);
  const tbb::blocked_range<int> range(0, 100);
  const auto same = [](const tbb::blocked_range<int>&, int value) { return value; };
  EXPECT_THROW((void)parallelReduce(range, 0, same, std::plus<>()), Cancelled);
  EXPECT_THROW((void)parallelDeterministicReduce(range, 0, same, std::plus<>()), Cancelled);
}

TEST(Completion, LetsLoopsEndAndIsKnownToTheWholeCall) {
  CancelToken whole;
  CancelToken part(&whole);
  part.cancel();
  const CancelScope scope(&part);
  {
    const Completion completion;
    EXPECT_TRUE(part.completing());
    EXPECT_TRUE(whole.completing());
    std::atomic<int> done = 0;
    parallelFor(0, 1000, [&](int) { ++done; });
    EXPECT_EQ(done, 1000);
  }
  EXPECT_FALSE(whole.completing());
  {
    const BestSoFar wanted;
    EXPECT_NO_THROW(CancelScope::check());
  }
  whole.discardResults();
  const BestSoFar unwanted;
  EXPECT_FALSE(whole.completing());
  EXPECT_THROW(CancelScope::check(), Cancelled);
}

}  // namespace
}  // namespace esvr
