#pragma once
/// A transfer function's tables on a CUDA device.

#include <optional>
#include <vector>

#include "core/cuda/growing_buffer.h"
#include "render/sample_rule.h"

namespace esvr::cuda {

class DeviceTable {
 public:
  /// Makes the table anew only if the transfer function or its step changed, because making it can
  /// take longer than drawing a picture.
  /// \param times  length of a step in units of options.step
  void update(const RenderOptions& options, double times, cudaStream_t stream) {
    const Sampling sampling = samplingOf(options, times);
    if (known_ && known_->sampling == sampling && known_->transfer == options.transfer) return;
    known_ = {options.transfer, sampling, TransferTable(options.transfer, sampling)};
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
