#include "fit/chunks/device_turns.h"

#include "fit/cuda/make_cuda_optimiser.h"

namespace esvr {

DeviceTurns::Gpu& DeviceTurns::gpu(int index) {
  const std::lock_guard lock(mutex_);
  return gpus_[index];
}

DeviceTurns::Turn DeviceTurns::take(const Device& device) {
  if (device.kind == DeviceKind::kCpu) return {};
  Gpu& used = gpu(device.index);
  Turn turn(used.inUse);
  if (!used.keptMemory) used.keptMemory = keepFreedMemory(device);
  return turn;
}

}  // namespace esvr
