#include "render/transfer_table.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esvr {
namespace {

Classified classified(const TransferFunction& f, double value, double length) {
  const Rgb color = colorAt(f.colors, value);
  const double alpha = 1.0 - std::pow(1.0 - opacityAt(f.opacity, value), length);
  return {float(color.r), float(color.g), float(color.b), float(alpha)};
}

}  // namespace

TransferTable::TransferTable(const TransferFunction& f, double length)
    : low_(std::min(f.colors.points.front().x, f.opacity.front().x)),
      scale_(kNoExtent),
      nan_(classified(f, std::numeric_limits<double>::quiet_NaN(), length)) {
  const double high = std::max(f.colors.points.back().x, f.opacity.back().x);
  if (high > low_) scale_ = kIntervals / (high - low_);
  for (int i = 0; i <= kIntervals; ++i)
    entries_.push_back(classified(f, low_ + (high - low_) * i / kIntervals, length));
  // Below all points are the first of those at one place, above them the last.
  entries_.front() =
      classified(f, std::nextafter(low_, -std::numeric_limits<double>::max()), length);
}

}  // namespace esvr
