#pragma once
/// The base class of tests that need a GPU. Without one they skip and say why.

#include <gtest/gtest.h>

#include "core/cuda/use_device.h"
#include "esvr/error.h"

namespace esvr::test {

class OnGpu : public testing::Test {
 protected:
  void SetUp() override {
    try {
      device_ = selectDevice("cuda");
      cuda::useDevice(device_);
    } catch (const DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
  }
  Device device_;
};

}  // namespace esvr::test
