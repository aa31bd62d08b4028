#include "esvr/device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/device_choice.h"
#include "esvr/error.h"

namespace esvr {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using testing::ThrowsMessage;

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
              ThrowsMessage<DeviceError>(HasSubstr("no driver")));
  EXPECT_THAT([] { (void)chooseDevice("cuda", onlyAnOldGpu()); },
              ThrowsMessage<DeviceError>(AllOf(HasSubstr("Old"), HasSubstr("too old"))));
}

TEST(ChooseDevice, CudaWithANumberTakesThatDeviceOrNone) {
  EXPECT_EQ(chooseDevice("cuda:2", threeGpus()).index, 2);
  EXPECT_THAT([] { (void)chooseDevice("cuda:0", threeGpus()); },
              ThrowsMessage<DeviceError>(HasSubstr("too old")));
  EXPECT_THAT([] { (void)chooseDevice("cuda:3", threeGpus()); },
              ThrowsMessage<DeviceError>(HasSubstr("there are 3")));
  EXPECT_THAT([] { (void)chooseDevice("cuda:0", noGpu()); },
              ThrowsMessage<DeviceError>(HasSubstr("no driver")));
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
              ThrowsMessage<DeviceError>(HasSubstr("no cuda:3")));
  EXPECT_THAT([] { (void)chooseDevices("cuda:all", noGpu()); },
              ThrowsMessage<DeviceError>(HasSubstr("no driver")));
  for (const char* text : {"cuda:1,", "cuda:,1", "cuda:1;2", "cuda:all,1"})
    EXPECT_THROW((void)chooseDevices(text, threeGpus()), UsageError) << text;
}

class MeaninglessDevice : public testing::TestWithParam<const char*> {};

TEST_P(MeaninglessDevice, IsAUsageErrorThatNamesIt) {
  EXPECT_THAT([] { (void)chooseDevice(GetParam(), threeGpus()); },
              ThrowsMessage<UsageError>(HasSubstr("'" + std::string(GetParam()) + "'")));
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

}  // namespace
}  // namespace esvr
