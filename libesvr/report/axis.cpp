#include "report/axis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace esvr::report {
namespace {

constexpr double kMargin = 0.04;  // margin at each end, relative to the range of the values

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

constexpr std::size_t kFewestTicks = 3;

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

namespace {

/// Ticks at equal distances. A step of the form 1, 2 or 5 may leave few of them, and the next smaller
/// one is then taken.
std::vector<Tick> linearTicks(double low, double high, std::size_t most) {
  constexpr double kAlwaysEnough = 7.5;  // intervals; a step is at most 2.5 times as large as asked
  auto ticks = roundTicks(low, high, double(most - 1));
  return ticks.size() < kFewestTicks ? roundTicks(low, high, kAlwaysEnough) : ticks;
}

}  // namespace

std::vector<Tick> Axis::decadeTicks(std::span<const double> digits, int stride) const {
  std::vector<Tick> ticks;
  for (double decade = stride * std::floor(low_ / stride); decade <= high_; decade += stride)
    for (const double digit : digits) {
      const double value = digit * std::pow(10.0, decade);
      if (holds(value)) ticks.push_back({value, labelOf(value)});
    }
  return ticks;
}

/// The densest ticks that are not too many. Where the axis is much shorter than a decade, they have
/// equal distances, as on a linear axis.
std::vector<Tick> Axis::logarithmicTicks(std::size_t most) const {
  constexpr std::array kAll{1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0};
  constexpr std::array kThree{1.0, 2.0, 5.0};
  constexpr std::array kTwo{1.0, 3.0};
  constexpr std::array kOne{1.0};
  for (const auto digits : {std::span<const double>(kAll), std::span<const double>(kThree),
                            std::span<const double>(kTwo)}) {
    auto ticks = decadeTicks(digits, 1);
    if (ticks.size() < kFewestTicks)
      return linearTicks(std::pow(10.0, low_), std::pow(10.0, high_), most);
    if (ticks.size() <= most) return ticks;
  }
  int stride = 1;
  while (decadeTicks(kOne, stride).size() > most) ++stride;
  return decadeTicks(kOne, stride);
}

std::vector<Tick> Axis::ticks(int most) const {
  return logarithmic_ ? logarithmicTicks(std::size_t(most))
                      : linearTicks(low_, high_, std::size_t(most));
}

}  // namespace esvr::report
