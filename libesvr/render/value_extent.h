#pragma once
/// The values between the first and the last point of a transfer function, which its tables cover.

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/transfer_function.h"

namespace esvr {

struct ValueExtent {
  double low, high;

  /// True if the extent is 0, or so small that float32 cannot divide a table's length by it.
  [[nodiscard]] bool flat() const {
    return !(high - low > std::numeric_limits<float>::min() * 1e5);
  }
  /// \param share  0 for the lowest value, 1 for the highest
  [[nodiscard]] double at(double share) const { return low + (high - low) * share; }
  /// A value that no point reaches. Several points may have the same x: below it, the first of them
  /// counts, and above it the last.
  [[nodiscard]] double below() const {
    return std::nextafter(low, -std::numeric_limits<double>::max());
  }
};

[[nodiscard]] inline ValueExtent extentOf(const TransferFunction& f) {
  return {std::min(f.colors.points.front().x, f.opacity.front().x),
          std::max(f.colors.points.back().x, f.opacity.back().x)};
}

}  // namespace esvr
