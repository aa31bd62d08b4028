#pragma once
/// A search for the bound at which quantised voxels reach a figure.

#include <algorithm>
#include <cmath>
#include <limits>

namespace esvr::convert {

/// Bounds are counted in octaves below the range of the values: 1 is half the range.
inline constexpr double kCoarsest = 1.0, kFinest = 24.0;  // float32 has 24 bits
inline constexpr double kDbPerOctave = 6.02;              // gain of PSNR by half the bound
inline constexpr double kNarrowest = 0.002;  // a bound that differs by 0.14 % is not tried

/// Finds the octave at which a figure that grows with it reaches an aim: by a usual slope while all
/// trials lie on one side, then by interpolation between the two sides.
class OctaveSearch {
 public:
  OctaveSearch(double aim, double slope, double first)
      : aim_(aim), slope_(slope), next_(std::clamp(first, kCoarsest, kFinest)) {}

  [[nodiscard]] double next() const { return next_; }
  [[nodiscard]] bool ended() const { return high_.octave - low_.octave < kNarrowest; }

  /// Takes the figure at next().
  void learn(double figure) {
    const bool isLow = figure < aim_;
    repeats_ = isLow == wasLow_ ? repeats_ + 1 : 0;
    wasLow_ = isLow;
    (isLow ? low_ : high_) = {next_, figure};
    const double width = high_.octave - low_.octave;
    double share = 0.5;
    if (low_.known() && high_.known())
      share = (aim_ - low_.figure) / (high_.figure - low_.figure);
    else if (std::isfinite(figure))
      share = (next_ + kOvershoot * (aim_ - figure) / slope_ - low_.octave) / width;
    // Where the figure jumps, interpolation would approach the jump from one side for a long time.
    if (repeats_ >= kMaxRepeats && low_.known() && high_.known())
      share = isLow ? 0.5 * (1.0 + share) : 0.5 * share;
    next_ = low_.octave + width * std::clamp(share, kInside, 1.0 - kInside);
  }

 private:
  struct Side {
    double octave, figure = std::numeric_limits<double>::quiet_NaN();
    [[nodiscard]] bool known() const { return std::isfinite(figure); }
  };
  static constexpr double kOvershoot = 1.1;  // so that the aim comes to lie between two trials
  static constexpr double kInside = 0.02;    // distance from both sides, relative to the interval
  static constexpr int kMaxRepeats = 2;      // repeated trials on a side, then steps are longer

  double aim_, slope_, next_;
  bool wasLow_ = false;  ///< whether the last trial was below the aim
  int repeats_ = 0;      ///< number of trials directly before the last one on its side of the aim
  Side low_{kCoarsest - kNarrowest}, high_{kFinest + kNarrowest};
};

}  // namespace esvr::convert
