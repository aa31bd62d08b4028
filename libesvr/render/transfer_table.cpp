#include "render/transfer_table.h"

#include <algorithm>
#include <array>
#include <limits>

namespace esvr {
namespace {

constexpr int kIntervals = SegmentSpan::kIntervals;
constexpr int kExtinction = SegmentEntry::kExtinction;
constexpr int kSamplesOfInterval = 4;  // values at which an interval is sampled

/// Bends that are neglected (SegmentTableView::bends), as a share of the table, where a step of the most
/// opaque value hides what is behind it. With a linear opacity, that of a segment then errs by less than this.
constexpr double kLeastBend = 1.0 / 16.0;

Classified classified(const TransferFunction& f, double value, double length) {
  const Rgb color = colorAt(f.colors, value);
  const double alpha = 1.0 - std::pow(1.0 - opacityAt(f.opacity, value), length);
  return {float(color.r), float(color.g), float(color.b), float(alpha)};
}

/// The channels of a SegmentEntry.
using Channels = std::array<double, SegmentEntry::kChannels>;

double extinctionOf(double opacity, double length) {
  return std::min(-std::log1p(-opacity) * length, double(SegmentTableView::kMaxExtinction));
}

Channels channelsAt(const TransferFunction& f, double value, double length) {
  const double extinction = extinctionOf(opacityAt(f.opacity, value), length);
  if (extinction == 0.0) return {};
  const Rgb c = colorAt(f.colors, value);
  return {c.r * extinction, c.g * extinction, c.b * extinction, extinction};
}

void addTimes(Channels& sum, const Channels& more, double times) {
  for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += times * more[c];
}

/// The means of all intervals in the order of the table.
std::vector<Channels> meansOf(const TransferFunction& f, const ValueExtent& extent, double length) {
  std::vector<Channels> means{channelsAt(f, extent.below(), length)};
  for (int i = 0; i < kIntervals; ++i) {
    Channels mean{};
    for (int p = 0; p < kSamplesOfInterval; ++p)
      addTimes(mean,
               channelsAt(f, extent.at((i + (p + 0.5) / kSamplesOfInterval) / kIntervals), length),
               1.0 / kSamplesOfInterval);
    means.push_back(mean);
  }
  means.push_back(channelsAt(f, extent.high, length));
  return means;
}

}  // namespace

bool ValueExtent::flat() const { return !(high - low > std::numeric_limits<float>::min() * 1e5); }

double ValueExtent::below() const {
  return std::nextafter(low, -std::numeric_limits<double>::max());
}

ValueExtent extentOf(const TransferFunction& f) {
  return {std::min(f.colors.points.front().x, f.opacity.front().x),
          std::max(f.colors.points.back().x, f.opacity.back().x)};
}

TransferTable::TransferTable(const TransferFunction& f, const Sampling& sampling)
    : nan_(classified(f, std::numeric_limits<double>::quiet_NaN(), sampling.length)) {
  const ValueExtent extent = extentOf(f);
  low_ = float(extent.low);
  scale_ =
      extent.flat() ? TransferTableView::kNoExtent : float(kIntervals / (extent.high - extent.low));
  values_.reserve(kIntervals + 1);
  for (int i = 0; i <= kIntervals; ++i)
    values_.push_back(classified(f, extent.at(double(i) / kIntervals), sampling.length));
  values_.front() = classified(f, extent.below(), sampling.length);
  if (sampling.segments) integrate(f, sampling.length);
}

void TransferTable::integrate(const TransferFunction& f, double length) {
  const ValueExtent extent = extentOf(f);
  segmentScale_ = extent.flat() ? 1.0f : scale_;
  const auto means = meansOf(f, extent, length);
  double most = 0.0;
  for (const Channels& mean : means) most = std::max(most, mean[kExtinction]);
  leastBend_ = extent.flat() ? 0.0f : float(kLeastBend * kIntervals / -std::expm1(-most));
  double total = 0.0;
  for (int i = 1; i <= kIntervals; ++i) total += means[std::size_t(i)][kExtinction];
  const double unitsOfOne = total > 0.0 ? std::numeric_limits<std::uint32_t>::max() / total : 0.0;
  unit_ = total > 0.0 ? float(1.0 / unitsOfOne) : 0.0f;
  Channels before{};
  for (std::size_t n = 0; n < means.size(); ++n) {
    SegmentEntry& entry = segments_.emplace_back();
    for (std::size_t c = 0; c < before.size(); ++c) {
      entry.before.c[c] = std::uint32_t(before[c] * unitsOfOne);
      entry.mean.c[c] = float(means[n][c]);
    }
    if (n > 0) addTimes(before, means[n], 1.0);
  }
  const Rgb& nan = f.colors.nan;
  nanSegment_ = {float(nan.r), float(nan.g), float(nan.b), 1.0f};
}

TransferTableView TransferTable::on(const Classified* values, const SegmentEntry* segments) const {
  return {
      values, low_, scale_, nan_, {segments, low_, segmentScale_, unit_, leastBend_, nanSegment_}};
}

}  // namespace esvr
