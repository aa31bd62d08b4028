#pragma once
/// Refuses CUDA in a build without it.

#include <string>

#include "core/cuda_probe.h"
#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr {

/// \param work  the operation, for the message: "fitting"
/// \throws DeviceError  always
[[noreturn]] inline void refuseCuda(const std::string& work, const Device& device) {
  throw DeviceError(work + " on cuda:" + std::to_string(device.index) + ": " +
                    probeCuda().whyNoDevices);
}

}  // namespace esvr
