#pragma once
/// The base class of tests that run on every device. Without a GPU, its tests skip and say why.

#include <gtest/gtest.h>

#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr::test {

class OnDevice : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    try {
      device_ = selectDevice(GetParam());
    } catch (const DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
  }
  Device device_;
};

}  // namespace esvr::test

#define ESVR_ON_DEVICES(Suite)                                             \
  INSTANTIATE_TEST_SUITE_P(Devices, Suite, testing::Values("cpu", "cuda"), \
                           [](const auto& device) { return std::string(device.param); })
