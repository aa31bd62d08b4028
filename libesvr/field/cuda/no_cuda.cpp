#include <string>

#include "core/cuda_probe.h"
#include "esvr/cuda/field.h"
#include "esvr/error.h"

namespace esvr {

void evaluateBricksCuda(const Field&, std::span<const Coord>, std::span<float>,
                        const Device& device) {
  throw DeviceError("evaluating on cuda:" + std::to_string(device.index) + ": " +
                    probeCuda().whyNoDevices);
}

}  // namespace esvr
