#include "render/transfer_table.h"

#include <cmath>
#include <limits>

#include "render/value_extent.h"

namespace esvr {
namespace {

constexpr int kLastEntry = TransferTableView::kIntervals;

Classified classified(const TransferFunction& f, double value, double length) {
  const Rgb color = colorAt(f.colors, value);
  const double alpha = 1.0 - std::pow(1.0 - opacityAt(f.opacity, value), length);
  return {float(color.r), float(color.g), float(color.b), float(alpha)};
}

}  // namespace

TransferTable::TransferTable(const TransferFunction& f, const Sampling& sampling)
    : nan_(classified(f, std::numeric_limits<double>::quiet_NaN(), sampling.length)) {
  const ValueExtent extent = extentOf(f);
  low_ = float(extent.low);
  scale_ =
      extent.flat() ? TransferTableView::kNoExtent : float(kLastEntry / (extent.high - extent.low));
  entries_.reserve(kLastEntry + 1);
  for (int i = 0; i <= kLastEntry; ++i)
    entries_.push_back(classified(f, extent.at(double(i) / kLastEntry), sampling.length));
  entries_.front() = classified(f, extent.below(), sampling.length);
  if (sampling.segments) segments_ = SegmentTable(f, sampling.length);
}

}  // namespace esvr
