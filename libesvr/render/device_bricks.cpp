#include "esvr/device_bricks.h"

#include "esvr/field.h"
#include "render/cuda/decode_bricks.h"

namespace esvr {

void evaluateBricksOn(const Device& device, const Field& field, std::span<const Coord> corners,
                      std::span<float> out) {
  if (device.kind == DeviceKind::kCuda)
    cuda::decodeBricks(device, field, corners, out);
  else
    evaluateBricks(field, corners, out);
}

Arithmetic arithmeticOf(const Device& device) {
  return {.integerSums = device.kind == DeviceKind::kCuda};
}

}  // namespace esvr
