#include "render/reference_light.h"

#include <algorithm>
#include <cmath>

namespace esvr::test {
namespace {

constexpr int kIntervals = 1 << 16;
constexpr double kMaxExtinction = 64.0, kThin = 0.25, kMaxPieces = 16.0;
constexpr std::size_t kExtinction = 3;

}  // namespace

Channels channelsAt(const TransferFunction& f, double value, double length) {
  const double extinction =
      std::min(-std::log1p(-opacityAt(f.opacity, value)) * length, kMaxExtinction);
  const Rgb c = colorAt(f.colors, value);
  return {c.r * extinction, c.g * extinction, c.b * extinction, extinction};
}

Integrals::Integrals(const TransferFunction& f, double length)
    : function_(f),
      length_(length),
      low_(std::min(f.colors.points.front().x, f.opacity.front().x)) {
  const double high = std::max(f.colors.points.back().x, f.opacity.back().x);
  scale_ = high > low_ ? kIntervals / (high - low_) : 1.0;
  means_.push_back(at(std::nextafter(low_, -1e300)));
  for (int i = 0; i < kIntervals; ++i)
    means_.push_back(at(high > low_ ? low_ + (i + 0.5) / scale_ : low_));
  means_.push_back(at(high));
  Channels before{};
  for (std::size_t n = 0; n < means_.size(); ++n) {
    before_.push_back(before);
    for (std::size_t c = 0; n > 0 && c < before.size(); ++c) before[c] += means_[n][c];
  }
}

double Integrals::placeOf(double value) const { return (value - low_) * scale_; }

double Integrals::upTo(double place, std::size_t channel) const {
  if (place < 0.0) return place * means_.front()[channel];
  const double interval = std::min(std::floor(place), double(kIntervals));
  const std::size_t n = std::size_t(interval) + 1;
  return before_[n][channel] + (place - interval) * means_[n][channel];
}

Channels Integrals::meanBetween(double a, double b) const {
  const double from = placeOf(std::min(a, b)), to = placeOf(std::max(a, b));
  if (to - from < 1e-3) return at(0.5 * (a + b));
  Channels mean;
  for (std::size_t c = 0; c < mean.size(); ++c)
    mean[c] = (upTo(to, c) - upTo(from, c)) / (to - from);
  return mean;
}

void LightOnRay::add(double value) {
  if (classification_ == Classification::kPreIntegrated) addSegment(last_, value);
  if (classification_ == Classification::kPost && value != background_)
    absorb(integrals_.at(value), 1.0);
  last_ = value;
}

void LightOnRay::addSegment(double a, double b) {
  if (a == background_ && b == background_) return;
  const double extinction = integrals_.meanBetween(a, b)[kExtinction];
  const double pieces = std::clamp(std::ceil(extinction / kThin), 1.0, kMaxPieces);
  for (double p = 0; p < pieces; ++p)
    absorb(integrals_.meanBetween(a + (b - a) * p / pieces, a + (b - a) * (p + 1) / pieces),
           1.0 / pieces);
}

void LightOnRay::absorb(const Channels& mean, double length) {
  if (!(mean[kExtinction] > 0.0)) return;
  const double alpha = -std::expm1(-mean[kExtinction] * length);
  const double weight = light_.transmittance * alpha / mean[kExtinction];
  light_.r += weight * mean[0], light_.g += weight * mean[1], light_.b += weight * mean[2];
  light_.transmittance *= 1.0 - alpha;
}

}  // namespace esvr::test
