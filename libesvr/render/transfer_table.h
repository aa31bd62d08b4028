#pragma once
/// A table of a transfer function, with opacities that are corrected for the distance between
/// samples. A renderer looks up every sample in it. The look-up is compiled for host and device.

#include <vector>

#include "esvr/kernel.h"
#include "esvr/render.h"

namespace esvr {

/// A color and opacity, not premultiplied.
struct alignas(16) Classified {
  float r, g, b, alpha;
};

/// Pointers to a table in host or device memory.
struct TransferTableView {
  static constexpr int kIntervals = 4096;
  static constexpr float kNoExtent = 0.0f;

  const Classified* entries;  ///< kIntervals + 1 entries
  float low, scale;           ///< lowest value, and intervals per unit of value
  Classified nan;

  [[nodiscard]] ESVR_HD Classified operator()(float value) const {
    if (!(value == value)) return nan;
    const float place =
        scale == kNoExtent ? (value < low ? 0.0f : float(kIntervals)) : (value - low) * scale;
    if (!(place > 0.0f)) return entries[0];
    if (place >= float(kIntervals)) return entries[kIntervals];
    const int i = int(place);
    return between(entries[i], entries[i + 1], place - float(i));
  }

 private:
  ESVR_HD static Classified between(const Classified& a, const Classified& b, float s) {
    return {a.r + s * (b.r - a.r), a.g + s * (b.g - a.g), a.b + s * (b.b - a.b),
            a.alpha + s * (b.alpha - a.alpha)};
  }
};

class TransferTable {
 public:
  /// \param length  length of a step, in units of the length that opacities are given for
  TransferTable(const TransferFunction& function, double length);

  [[nodiscard]] Classified operator()(float value) const { return view()(value); }
  [[nodiscard]] TransferTableView view() const { return on(entries_.data()); }
  [[nodiscard]] const std::vector<Classified>& entries() const { return entries_; }
  /// A view of a copy of the entries, for example on a device.
  [[nodiscard]] TransferTableView on(const Classified* entries) const {
    return {entries, low_, scale_, nan_};
  }

 private:
  float low_, scale_;
  std::vector<Classified> entries_;
  Classified nan_;
};

}  // namespace esvr
