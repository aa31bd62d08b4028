#include "render/transfer_table.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esvr {
namespace {

constexpr int kIntervals = TransferTableView::kIntervals;

Classified classified(const TransferFunction& f, double value, double length) {
  const Rgb color = colorAt(f.colors, value);
  const double alpha = 1.0 - std::pow(1.0 - opacityAt(f.opacity, value), length);
  return {float(color.r), float(color.g), float(color.b), float(alpha)};
}

/// Intervals per unit of value; kNoExtent if the extent is 0, or so small that float32 cannot hold
/// the result.
float scaleOf(double extent) {
  const double scale = extent > 0.0 ? kIntervals / extent : 0.0;
  return scale < std::numeric_limits<float>::max() ? float(scale) : TransferTableView::kNoExtent;
}

}  // namespace

TransferTable::TransferTable(const TransferFunction& f, double length)
    : nan_(classified(f, std::numeric_limits<double>::quiet_NaN(), length)) {
  const double low = std::min(f.colors.points.front().x, f.opacity.front().x);
  const double high = std::max(f.colors.points.back().x, f.opacity.back().x);
  low_ = float(low), scale_ = scaleOf(high - low);
  entries_.reserve(kIntervals + 1);
  for (int i = 0; i <= kIntervals; ++i)
    entries_.push_back(classified(f, low + (high - low) * i / kIntervals, length));
  // Several points may have the same x. Below it, the first of them counts, and above it the last.
  entries_.front() =
      classified(f, std::nextafter(low, -std::numeric_limits<double>::max()), length);
}

}  // namespace esvr
