#pragma once
/// A transfer function sampled, with opacities for the step: what a renderer asks for every sample.
/// The looking up is written once for host and device.

#include <vector>

#include "esvr/kernel.h"
#include "esvr/render.h"

namespace esvr {

/// Not premultiplied.
struct alignas(16) Classified {
  float r, g, b, alpha;
};

/// A table wherever it lies.
struct TransferTableView {
  static constexpr int kIntervals = 4096;
  static constexpr float kNoExtent = 0.0f;

  const Classified* entries;  ///< kIntervals + 1
  float low, scale;           ///< scale: intervals for one unit of value
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
  /// \param length  of a step, in units of the length that opacities are given for
  TransferTable(const TransferFunction& function, double length);

  [[nodiscard]] Classified operator()(float value) const { return view()(value); }
  [[nodiscard]] TransferTableView view() const { return on(entries_.data()); }
  [[nodiscard]] const std::vector<Classified>& entries() const { return entries_; }
  /// With the entries copied elsewhere.
  [[nodiscard]] TransferTableView on(const Classified* entries) const {
    return {entries, low_, scale_, nan_};
  }

 private:
  float low_, scale_;
  std::vector<Classified> entries_;
  Classified nan_;
};

}  // namespace esvr
