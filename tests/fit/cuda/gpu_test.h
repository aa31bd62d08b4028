#pragma once
/// Tests that call functions of CUDA themselves.

#include "core/cuda/runtime.h"
#include "support/machine.h"

namespace esvr::test {

class CudaTest : public OnGpu {
 protected:
  void SetUp() override {
    OnGpu::SetUp();
    if (!IsSkipped()) cuda::useDevice(device_);
  }
};

}  // namespace esvr::test
