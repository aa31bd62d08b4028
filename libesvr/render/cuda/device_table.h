#pragma once
/// A transfer function's table on a CUDA device.

#include <optional>

#include "core/cuda/growing_buffer.h"
#include "render/sample_rule.h"

namespace esvr::cuda {

class DeviceTable {
 public:
  /// Makes the table anew only if the transfer function or its step changed, because making it can
  /// take longer than drawing a picture.
  void update(const RenderOptions& options, cudaStream_t stream) {
    const double length = opacitySteps(options);
    if (known_ && known_->length == length && known_->transfer == options.transfer) return;
    known_ = {options.transfer, length, TransferTable(options.transfer, length)};
    const auto& entries = known_->table.entries();
    makeRoom(entries_, entries.size(), stream);
    entries_.upload(entries);
  }
  /// Must be called after update().
  [[nodiscard]] TransferTableView view() const { return known_->table.on(entries_.data()); }
  [[nodiscard]] std::size_t bytes() const { return entries_.bytes(); }

 private:
  struct Known {
    TransferFunction transfer;
    double length;
    TransferTable table;
  };
  std::optional<Known> known_;
  DeviceBuffer<Classified> entries_;
};

}  // namespace esvr::cuda
