#pragma once
/// Tables of a transfer function, with opacities that are corrected for the distance between
/// samples. A renderer looks up every sample, or every segment between two samples, in them. The
/// look-up is compiled for host and device.

#include <vector>

#include "esvr/kernel.h"
#include "esvr/render.h"
#include "render/segment_table.h"

namespace esvr {

/// A color and opacity, not premultiplied.
struct alignas(16) Classified {
  float r, g, b, alpha;
};

/// Pointers to the tables in host or device memory.
struct TransferTableView {
  static constexpr int kIntervals = SegmentSpan::kIntervals;
  static constexpr float kNoExtent = 0.0f;

  const Classified* entries;  ///< kIntervals + 1 entries
  float low, scale;           ///< lowest value, and intervals per unit of value
  Classified nan;
  SegmentTableView segments;  ///< empty unless Sampling::segments asked for it

  /// The color and opacity of a value.
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

/// What the tables are made for.
struct Sampling {
  double length;  ///< length of a step, in units of the length that opacities are given for
  bool segments;  ///< true if segments between samples are looked up
  friend bool operator==(const Sampling&, const Sampling&) = default;
};

class TransferTable {
 public:
  /// Pointers to copies of both tables' entries, for example on a device.
  struct Copies {
    const Classified* values;
    const SegmentEntry* segments;
  };

  TransferTable(const TransferFunction& function, const Sampling& sampling);

  [[nodiscard]] TransferTableView view() const {
    return on({entries_.data(), segments_.entries().data()});
  }
  [[nodiscard]] const std::vector<Classified>& values() const { return entries_; }
  [[nodiscard]] const std::vector<SegmentEntry>& segments() const { return segments_.entries(); }
  [[nodiscard]] TransferTableView on(const Copies& copies) const {
    return {copies.values, low_, scale_, nan_, segments_.on(copies.segments)};
  }

 private:
  float low_, scale_;
  std::vector<Classified> entries_;
  SegmentTable segments_;
  Classified nan_;
};

}  // namespace esvr
