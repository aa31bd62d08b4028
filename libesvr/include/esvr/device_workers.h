#pragma once
/// Runs the parts of a fit in chunks on several devices of this process.

#include <memory>
#include <vector>

#include "esvr/device.h"
#include "esvr/part_runner.h"
#include "esvr/part_store.h"

namespace esvr {

class WorkingDevices;

/// A thread for each device takes one part after the other.
class DeviceWorkers : public PartRunner {
 public:
  /// \param devices  at least one. If the CPU is listed twice, it runs two parts at the same time;
  ///                 if a GPU is, a part is prepared on the host while the GPU fits another one
  /// \param onLost   is told when a device fails and the others do its parts; it may be empty
  /// \param store    holds the results of parts, which are not fitted again; may be null
  explicit DeviceWorkers(std::vector<Device> devices, LostDevice onLost = {},
                         PartStore* store = nullptr);
  ~DeviceWorkers() override;

  /// \throws DeviceError  all devices have failed
  /// \throws BadInput  a result in the store is damaged
  /// \throws Error  what else a part threw; the other devices end their current parts first
  std::vector<std::vector<std::byte>> run(const RoundParts& parts) override;

 private:
  std::vector<Device> devices_;
  std::unique_ptr<WorkingDevices> working_;
  PartStore* store_;
};

}  // namespace esvr
