#pragma once
/// Runs work on several devices.

#include <cstddef>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "esvr/device.h"
#include "esvr/part_runner.h"
#include "esvr/part_store.h"

namespace esvr {

/// Calls work(device) for every device, each on its own thread, and waits for all calls.
/// \param stop  is called if a call fails, so that the others can end early
/// \throws Error  what the first call that failed threw, in the order of the devices
void onDevices(std::span<const Device> devices, const std::function<void(const Device&)>& work,
               const std::function<void()>& stop);

/// Devices of one kind, which give the same results. Where one fails, the others do its parts.
class WorkingDevices {
 public:
  /// \param onLost  may be empty
  WorkingDevices(std::span<const Device> devices, LostDevice onLost);

  /// Fits a part on a device; if this device fails or has failed, on another one.
  /// \throws DeviceError  no device is left
  [[nodiscard]] PartOutput fit(const RoundParts& parts, std::size_t part, const Device& device);

 private:
  [[nodiscard]] Device workingFor(const Device& device);
  void lose(const Device& device, const std::string& why);

  std::mutex mutex_;
  std::vector<Device> left_;  ///< without repetitions
  std::size_t next_ = 0;      ///< counts the parts that were given to another device
  LostDevice onLost_;
};

/// The result of a part from the store, or what `fit` makes, which is then stored if it is complete.
/// \param store  may be null
/// \throws BadInput  the result in the store is damaged
[[nodiscard]] std::vector<std::byte> storedOrFitted(PartStore* store, const RoundParts& parts,
                                                    std::size_t part,
                                                    const std::function<PartOutput()>& fit);

}  // namespace esvr
