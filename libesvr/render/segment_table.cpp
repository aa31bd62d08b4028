#include "render/segment_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "render/value_extent.h"

namespace esvr {
namespace {

constexpr int kIntervals = SegmentSpan::kIntervals;
constexpr int kExtinction = SegmentEntry::kExtinction;
constexpr int kSamplesOfInterval = 4;  // values at which an interval is sampled

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

double totalExtinction(const std::vector<Channels>& means) {
  double total = 0.0;
  for (int i = 1; i <= kIntervals; ++i) total += means[std::size_t(i)][kExtinction];
  return total;
}

}  // namespace

SegmentTable::SegmentTable(const TransferFunction& f, double length) {
  const ValueExtent extent = extentOf(f);
  low_ = float(extent.low);
  scale_ = extent.flat() ? 1.0f : float(kIntervals / (extent.high - extent.low));
  const auto means = meansOf(f, extent, length);
  const double total = totalExtinction(means);
  const double unitsOfOne = total > 0.0 ? std::numeric_limits<std::uint32_t>::max() / total : 0.0;
  unit_ = total > 0.0 ? float(1.0 / unitsOfOne) : 0.0f;
  Channels before{};
  for (std::size_t n = 0; n < means.size(); ++n) {
    SegmentEntry& entry = entries_.emplace_back();
    for (std::size_t c = 0; c < before.size(); ++c) {
      entry.before.c[c] = std::uint32_t(before[c] * unitsOfOne);
      entry.mean.c[c] = float(means[n][c]);
    }
    if (n > 0) addTimes(before, means[n], 1.0);
  }
  const Rgb& nan = f.colors.nan;
  nan_ = {float(nan.r), float(nan.g), float(nan.b), 1.0f};
}

}  // namespace esvr
