#pragma once
/// The CUDA entry points refuse in a build without CUDA.

#include <string>

#include "core/cuda_probe.h"
#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr {

/// \param work  what was to be done there, for the message: "fitting"
/// \throws DeviceError  always
[[noreturn]] inline void refuseCuda(const std::string& work, const Device& device) {
  throw DeviceError(work + " on cuda:" + std::to_string(device.index) + ": " +
                    probeCuda().whyNoDevices);
}

}  // namespace esvr
