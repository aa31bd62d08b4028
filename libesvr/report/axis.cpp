#include "report/axis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace esvr::report {
namespace {

constexpr double kMargin = 0.04;  // margin at each end, relative to the range of the values
constexpr double kMaxTicks = 8.0;

std::string labelOf(double value) {
  constexpr double kPlainFrom = 1e-3, kPlainTo = 1e6;
  const double size = std::abs(value);
  const bool plain = size == 0.0 || (size >= kPlainFrom && size < kPlainTo);
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), plain ? "%.6g" : "%.0e", value);
  return text.data();
}

/// The smallest number of the form 1, 2 or 5 times a power of ten that is not below a number.
double roundUp(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0})
    if (digit * power >= value) return digit * power;
  return 10.0 * power;
}

}  // namespace

Axis::Axis(std::span<const double> values, bool logarithmic) : logarithmic_(logarithmic) {
  include(values);
  const double room = high_ > low_ ? kMargin * (high_ - low_) : 0.5;
  low_ -= room;
  high_ += room;
}

void Axis::include(std::span<const double> values) {
  bool any = false;
  for (const double value : values) {
    if (!std::isfinite(value) || (logarithmic_ && value <= 0.0)) continue;
    const double at = scaled(value);
    low_ = any ? std::min(low_, at) : at;
    high_ = any ? std::max(high_, at) : at;
    any = true;
  }
}

double Axis::scaled(double value) const { return logarithmic_ ? std::log10(value) : value; }

bool Axis::holds(double value) const {
  return std::isfinite(value) && (!logarithmic_ || value > 0.0) && scaled(value) >= low_ &&
         scaled(value) <= high_;
}

double Axis::place(double value) const { return (scaled(value) - low_) / (high_ - low_); }

std::vector<double> Axis::linearTicks() const {
  const double step = roundUp((high_ - low_) / kMaxTicks);
  std::vector<double> values;
  for (double n = std::ceil(low_ / step); n * step <= high_; ++n) values.push_back(n * step);
  return values;
}

/// Ticks at the powers of ten; if there are few of them, also at 2 and 5, or at every digit.
std::vector<double> Axis::logarithmicTicks() const {
  constexpr double kFewDecades = 3.0, kOneDecade = 1.0;
  const double decades = high_ - low_;
  const std::vector<double> digits = decades > kFewDecades ? std::vector<double>{1}
                                     : decades > kOneDecade
                                         ? std::vector<double>{1, 2, 5}
                                         : std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9};
  std::vector<double> values;
  for (double decade = std::floor(low_); decade <= high_; ++decade)
    for (const double digit : digits) {
      const double value = digit * std::pow(10.0, decade);
      if (holds(value)) values.push_back(value);
    }
  return values;
}

std::vector<Tick> Axis::ticks() const {
  std::vector<Tick> ticks;
  for (const double value : logarithmic_ ? logarithmicTicks() : linearTicks())
    ticks.push_back({value, labelOf(value)});
  return ticks;
}

}  // namespace esvr::report
