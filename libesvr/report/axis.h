#pragma once
/// An axis of a plot: from values to places, and where to write numbers.

#include <span>
#include <string>
#include <vector>

namespace esvr::report {

struct Tick {
  double value = 0.0;
  std::string label;
};

class Axis {
 public:
  /// An axis that holds all values and some room around them. On a logarithmic one values that are
  /// not above 0 take no part.
  Axis(std::span<const double> values, bool logarithmic);

  [[nodiscard]] bool holds(double value) const;
  /// 0 at the lower end, 1 at the upper. \param value  one that the axis holds
  [[nodiscard]] double place(double value) const;
  /// At round numbers, some five to ten of them.
  [[nodiscard]] std::vector<Tick> ticks() const;

 private:
  [[nodiscard]] double scaled(double value) const;
  void include(std::span<const double> values);
  [[nodiscard]] std::vector<double> linearTicks() const;
  [[nodiscard]] std::vector<double> logarithmicTicks() const;

  bool logarithmic_;
  double low_ = 0.0, high_ = 1.0;  ///< of what scaled() gives
};

}  // namespace esvr::report
