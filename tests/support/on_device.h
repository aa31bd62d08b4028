#pragma once
/// Tests that need a device: where it cannot be used they skip and say why.

#include <gtest/gtest.h>

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

#define ESVR_ON_DEVICES(Suite)                                             \
  INSTANTIATE_TEST_SUITE_P(Devices, Suite, testing::Values("cpu", "cuda"), \
                           [](const auto& device) { return std::string(device.param); })
