#include "distribute/on_devices.h"

#include <algorithm>
#include <exception>
#include <future>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "esvr/progress.h"

namespace esvr {

void onDevices(std::span<const Device> devices, const std::function<void(const Device&)>& work,
               const std::function<void()>& stop) {
  if (devices.size() == 1) return work(devices.front());
  std::vector<std::future<void>> running;
  for (const Device& device : devices)
    running.push_back(std::async(std::launch::async, [&, device, token = CancelScope::token()] {
      const CancelScope scope(token);
      try {
        work(device);
      } catch (...) {
        stop();
        throw;
      }
    }));
  for (auto& call : running) call.wait();
  for (auto& call : running) call.get();
}

WorkingDevices::WorkingDevices(std::span<const Device> devices, LostDevice onLost)
    : onLost_(std::move(onLost)) {
  for (const Device& device : devices)
    if (std::ranges::count(left_, device) == 0) left_.push_back(device);
}

PartOutput WorkingDevices::fit(const RoundParts& parts, std::size_t part, const Device& own) {
  for (;;) {
    const Device device = workingFor(own);
    try {
      return parts.fit(part, device);
    } catch (const DeviceError& error) {
      lose(device, error.what());
    }
  }
}

Device WorkingDevices::workingFor(const Device& device) {
  const std::lock_guard lock(mutex_);
  if (left_.empty()) throw DeviceError("all devices have failed");
  if (std::ranges::count(left_, device) > 0) return device;
  return left_[next_++ % left_.size()];
}

std::vector<std::byte> storedOrFitted(PartStore* store, const RoundParts& parts, std::size_t part,
                                      const std::function<PartOutput()>& fit) {
  if (!store) return fit().bytes;
  const PartKey key = parts.keyOf(part);
  if (auto found = store->find(key)) return std::move(*found);
  PartOutput output = fit();
  if (output.complete) store->put(key, output.bytes);
  return std::move(output.bytes);
}

/// To be called while the device's error is handled, which is thrown again if no device is left.
void WorkingDevices::lose(const Device& device, const std::string& why) {
  const std::lock_guard lock(mutex_);
  const bool isKnown = std::erase(left_, device) == 0;
  if (left_.empty()) throw;
  if (!isKnown && onLost_) onLost_(device, why);
}

}  // namespace esvr
