#include "esvr/device_workers.h"

#include <atomic>
#include <utility>

#include "distribute/on_devices.h"

namespace esvr {

DeviceWorkers::DeviceWorkers(std::vector<Device> devices, LostDevice onLost, PartStore* store)
    : devices_(std::move(devices)),
      working_(std::make_unique<WorkingDevices>(devices_, std::move(onLost))),
      store_(store) {}

DeviceWorkers::~DeviceWorkers() = default;

std::vector<std::vector<std::byte>> DeviceWorkers::run(const RoundParts& parts) {
  std::vector<std::vector<std::byte>> results(parts.count());
  std::atomic<std::size_t> next{0};
  const auto work = [&](const Device& device) {
    for (std::size_t p = next++; p < parts.count(); p = next++)
      results[p] =
          storedOrFitted(store_, parts, p, [&] { return working_->fit(parts, p, device); });
  };
  onDevices(devices_, work, [&] { next = parts.count(); });
  return results;
}

}  // namespace esvr
