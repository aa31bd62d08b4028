#include "distribute/on_devices.h"

#include <exception>
#include <future>
#include <vector>

namespace esvr {

void onDevices(std::span<const Device> devices, const std::function<void(const Device&)>& work,
               const std::function<void()>& stop) {
  if (devices.size() == 1) return work(devices.front());
  std::vector<std::future<void>> running;
  for (const Device& device : devices)
    running.push_back(std::async(std::launch::async, [&, device] {
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

}  // namespace esvr
