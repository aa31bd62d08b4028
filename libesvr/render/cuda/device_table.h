#pragma once
/// A transfer function's tables on a CUDA device.

#include <optional>
#include <vector>

#include "core/cuda/growing_buffer.h"
#include "render/sample_rule.h"

namespace esvr::cuda {

class DeviceTable {
 public:
  /// Makes the table anew only if the transfer function or its sampling changed, because making it
  /// can take longer than drawing a picture.
  void update(const TransferFunction& transfer, const Sampling& sampling, cudaStream_t stream) {
    if (known_ && known_->sampling == sampling && known_->transfer == transfer) return;
    known_ = {transfer, sampling, TransferTable(transfer, sampling)};
    copy(known_->table.values(), values_, stream);
    copy(known_->table.segments(), segments_, stream);
  }
  /// Must be called after update().
  [[nodiscard]] TransferTableView view() const {
    return known_->table.on({values_.data(), segments_.data()});
  }
  [[nodiscard]] std::size_t bytes() const { return values_.bytes() + segments_.bytes(); }

 private:
  struct Known {
    TransferFunction transfer;
    Sampling sampling;
    TransferTable table;
  };

  template <class Entry>
  static void copy(const std::vector<Entry>& from, DeviceBuffer<Entry>& to, cudaStream_t stream) {
    if (from.empty()) return;
    makeRoom(to, from.size(), stream);
    to.upload(from);
  }

  std::optional<Known> known_;
  DeviceBuffer<Classified> values_;
  DeviceBuffer<SegmentEntry> segments_;
};

}  // namespace esvr::cuda
