#include "report/axis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace esvr::report {
namespace {

constexpr double kMargin = 0.04;  // margin at each end, relative to the range of the values
constexpr double kMaxTicks = 8.0;

constexpr double kRounding = 1e-6;  // relative error of ends, which may be rounded to float32
constexpr double kPlainFrom = 1e-3, kPlainTo = 1e6;  // numbers that need no exponent

std::string labelOf(double value) {
  const double size = std::abs(value);
  const bool plain = size == 0.0 || (size >= kPlainFrom && size < kPlainTo);
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), plain ? "%.6g" : "%.0e", value);
  return text.data();
}

int powerOf(double value) { return int(std::floor(std::log10(value) + kRounding)); }

/// The labels of multiples of a step.
class StepLabels {
 public:
  /// \param largest  size of the largest value
  StepLabels(double step, double largest)
      : plain_(step >= kPlainFrom && largest < kPlainTo),
        digits_(plain_ ? std::max(0, -powerOf(step))
                       : std::max(0, powerOf(largest) - powerOf(step))) {}

  [[nodiscard]] std::string of(double value) const {
    if (value == 0.0) return "0";
    std::array<char, 64> text;
    std::snprintf(text.data(), text.size(), plain_ ? "%.*f" : "%.*e", digits_, value);
    return text.data();
  }

 private:
  bool plain_;
  int digits_;
};

/// The smallest number of the form 1, 2 or 5 times a power of ten that is not below a number, up to
/// rounding.
double roundUp(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0})
    if (digit * power >= value * (1.0 - kRounding)) return digit * power;
  return 10.0 * power;
}

}  // namespace

std::vector<Tick> roundTicks(double low, double high, double intervals) {
  constexpr double kNarrowest = 1e-12;  // smallest range, relative to its values
  const double range = high - low, largest = std::max(std::abs(low), std::abs(high));
  if (!(range > kNarrowest * largest) || !std::isfinite(range)) return {{low, labelOf(low)}};
  const double room = kRounding * range, step = roundUp(range / intervals);
  const double first = std::ceil((low - room) / step);
  const StepLabels labels(step, largest);
  std::vector<Tick> ticks;
  for (double i = 0.0; i <= intervals && (first + i) * step <= high + room; ++i) {
    const double value = (first + i) * step + 0.0;  // the sum turns -0 into 0
    ticks.push_back({value, labels.of(value)});
  }
  return ticks;
}

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

/// Ticks at the powers of ten; if there are few of them, also at 2 and 5, or at every digit.
std::vector<Tick> Axis::logarithmicTicks() const {
  constexpr double kFewDecades = 3.0, kOneDecade = 1.0;
  const double decades = high_ - low_;
  const std::vector<double> digits = decades > kFewDecades ? std::vector<double>{1}
                                     : decades > kOneDecade
                                         ? std::vector<double>{1, 2, 5}
                                         : std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9};
  std::vector<Tick> ticks;
  for (double decade = std::floor(low_); decade <= high_; ++decade)
    for (const double digit : digits) {
      const double value = digit * std::pow(10.0, decade);
      if (holds(value)) ticks.push_back({value, labelOf(value)});
    }
  return ticks;
}

std::vector<Tick> Axis::ticks() const {
  return logarithmic_ ? logarithmicTicks() : roundTicks(low_, high_, kMaxTicks);
}

}  // namespace esvr::report
