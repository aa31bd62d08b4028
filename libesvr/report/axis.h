#pragma once
/// An axis of a plot: it maps values to positions and chooses the ticks.

#include <span>
#include <string>
#include <vector>

namespace esvr::report {

struct Tick {
  double value = 0.0;
  std::string label;
};

/// Ticks at round numbers from `low` to `high`. The labels have as many digits as distinguish them.
/// A range that is too narrow for that, or not finite, has one tick, at `low`.
/// \param intervals  largest number of intervals between the ticks
[[nodiscard]] std::vector<Tick> roundTicks(double low, double high, double intervals);

class Axis {
 public:
  /// Makes an axis that covers all values with a margin. A logarithmic axis ignores values that are
  /// not above 0.
  Axis(std::span<const double> values, bool logarithmic);

  [[nodiscard]] bool holds(double value) const;
  /// The position of a value: 0 at the lower end, 1 at the upper end.
  /// \param value  a value that the axis covers
  [[nodiscard]] double place(double value) const;
  /// Ticks at round numbers: as many as there can be, at most `most`. There are at least three if
  /// `most` is at least kFewestAllowed, unless the ends of the axis are hardly different.
  [[nodiscard]] std::vector<Tick> ticks(int most = kUsualTicks) const;

  static constexpr int kUsualTicks = 9, kFewestAllowed = 7;

 private:
  [[nodiscard]] double scaled(double value) const;
  void include(std::span<const double> values);
  /// Ticks at these multiples of every power of ten whose exponent is a multiple of `stride`.
  [[nodiscard]] std::vector<Tick> decadeTicks(std::span<const double> digits, int stride) const;
  [[nodiscard]] std::vector<Tick> logarithmicTicks(std::size_t most) const;

  bool logarithmic_;
  double low_ = 0.0, high_ = 1.0;  ///< range of the results of scaled()
};

}  // namespace esvr::report
