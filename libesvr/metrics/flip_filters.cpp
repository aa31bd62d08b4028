#include "metrics/flip_filters.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/parallel.h"

namespace esvr::metrics {
namespace {

constexpr int kRowsPerTask = 16;
constexpr double kPi = std::numbers::pi;
constexpr double kRadiusInSigmas = 3.0;  // radius of a filter in standard deviations

/// A Gaussian of the paper's fit: a sqrt(pi / b) exp(-pi^2 d^2 / b) with d in degrees.
struct Term {
  double a, b;
};
constexpr Term kAchromatic{1.0, 0.0047}, kRedGreen{1.0, 0.0053}, kBlueYellow1{34.1, 0.04},
    kBlueYellow2{13.5, 0.025};
constexpr double kWidest = kBlueYellow1.b;

constexpr double kEdgeWidth = 0.082;  // degrees: two standard deviations

double sum(const Taps& taps) { return std::accumulate(taps.begin(), taps.end(), 0.0); }

/// The weights weight(x) for x from -radius to radius.
template <class Weight>
Taps makeTaps(int radius, const Weight& weight) {
  Taps taps;
  for (int x = -radius; x <= radius; ++x) taps.push_back(weight(double(x)));
  return taps;
}

Taps scaled(Taps taps, double by) {
  for (double& tap : taps) tap *= by;
  return taps;
}

Taps gaussian(const Term& term, double pixelsPerDegree, int radius) {
  return makeTaps(radius, [&](double x) {
    const double degrees = x / pixelsPerDegree;
    return std::exp(-kPi * kPi * degrees * degrees / term.b);
  });
}

/// Makes blurs of the terms; their shares have the sum 1.
std::vector<Blur> blursOf(std::initializer_list<Term> terms, double pixelsPerDegree, int radius) {
  std::vector<Blur> blurs;
  double total = 0.0;
  for (const Term& term : terms) {
    const Taps taps = gaussian(term, pixelsPerDegree, radius);
    const double along = sum(taps);
    const double weight = term.a * std::sqrt(kPi / term.b) * along * along;
    blurs.push_back({weight, scaled(taps, 1.0 / along)});
    total += weight;
  }
  for (Blur& blur : blurs) blur.share /= total;
  return blurs;
}

/// Scales the positive weights to the sum 1 and the negative ones to the sum -1.
Taps balanced(Taps taps) {
  double positive = 0.0, negative = 0.0;
  for (const double tap : taps) (tap > 0.0 ? positive : negative) += std::abs(tap);
  for (double& tap : taps) tap /= tap > 0.0 ? positive : negative;
  return taps;
}

void filterRow(const double* from, int width, const Taps& taps, double* to) {
  const int radius = int(taps.size()) / 2;
  for (int x = 0; x < width; ++x) {
    double value = 0.0;
    for (int t = -radius; t <= radius; ++t)
      value += taps[std::size_t(t + radius)] * from[std::clamp(x + t, 0, width - 1)];
    to[x] = value;
  }
}

template <class OfRow>
Plane rowByRow(const Plane& like, const OfRow& ofRow) {
  Plane result{like.width, like.height, std::vector<double>(like.values.size())};
  parallelFor(tbb::blocked_range<int>(0, like.height, kRowsPerTask), [&](const auto& range) {
    for (int y = range.begin(); y != range.end(); ++y)
      ofRow(y, &result.values[std::size_t(y) * like.width]);
  });
  return result;
}

Plane filteredAlongY(const Plane& plane, const Taps& taps) {
  const int radius = int(taps.size()) / 2;
  return rowByRow(plane, [&](int y, double* to) {
    for (int t = -radius; t <= radius; ++t) {
      const int from = std::clamp(y + t, 0, plane.height - 1);
      const double weight = taps[std::size_t(t + radius)];
      const double* row = &plane.values[std::size_t(from) * plane.width];
      for (int x = 0; x < plane.width; ++x) to[x] += weight * row[x];
    }
  });
}

}  // namespace

Plane filtered(const Plane& plane, const Taps& x, const Taps& y) {
  const Plane alongX = rowByRow(plane, [&](int row, double* to) {
    filterRow(&plane.values[std::size_t(row) * plane.width], plane.width, x, to);
  });
  return filteredAlongY(alongX, y);
}

EyeFilters eyeFilters(double ppd) {
  const int radius = int(std::ceil(kRadiusInSigmas * std::sqrt(kWidest / (2.0 * kPi * kPi)) * ppd));
  return {blursOf({kAchromatic}, ppd, radius), blursOf({kRedGreen}, ppd, radius),
          blursOf({kBlueYellow1, kBlueYellow2}, ppd, radius)};
}

Plane blurred(const Plane& plane, const std::vector<Blur>& blurs) {
  Plane result{plane.width, plane.height, std::vector<double>(plane.values.size())};
  for (const Blur& blur : blurs) {
    const Plane part = filtered(plane, blur.taps, blur.taps);
    for (std::size_t i = 0; i < part.values.size(); ++i)
      result.values[i] += blur.share * part.values[i];
  }
  return result;
}

FeatureFilters featureFilters(double ppd) {
  const double deviation = 0.5 * kEdgeWidth * ppd;
  const int radius = int(std::ceil(kRadiusInSigmas * deviation));
  const auto bell = [&](double x) { return std::exp(-x * x / (2.0 * deviation * deviation)); };
  const Taps across = makeTaps(radius, bell);
  return {balanced(makeTaps(radius, [&](double x) { return -x * bell(x); })),
          balanced(makeTaps(
              radius, [&](double x) { return (x * x / (deviation * deviation) - 1.0) * bell(x); })),
          scaled(across, 1.0 / sum(across))};
}

}  // namespace esvr::metrics
