#pragma once
/// Lets one part after the other use a GPU, so that another part can be prepared on the host
/// meanwhile.

#include <map>
#include <memory>
#include <mutex>

#include "esvr/device.h"

namespace esvr {

/// Any thread may use it. While it exists, the memory of GPUs that parts have freed is kept for the
/// next ones.
class DeviceTurns {
 public:
  using Turn = std::unique_lock<std::mutex>;

  /// Waits until no other part uses a GPU, until the turn is released. There is no waiting for the
  /// CPU, on which parts may run at the same time.
  [[nodiscard]] Turn take(const Device& device);

 private:
  struct Gpu {
    std::mutex inUse;
    std::shared_ptr<void> keptMemory;
  };
  [[nodiscard]] Gpu& gpu(int index);

  std::mutex mutex_;
  std::map<int, Gpu> gpus_;  ///< by their numbers
};

}  // namespace esvr
