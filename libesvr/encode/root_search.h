#pragma once
/// The one search of the encoder: where does a figure that grows with x reach an aim? x is a logarithm: of the number of
/// ellipsoids, of the fineness of a lattice, or of the fineness of quantisation steps. The figure is a PSNR, or bytes.

#include <algorithm>
#include <cmath>
#include <limits>

namespace esvr::encode {

/// Where a search looks. All values of x are in the unit of the search, usually octaves.
struct RootRange {
  double low = 0.0, high = 0.0;  ///< the aim is taken to lie between them
  double narrowest = 0.0;        ///< the search ends when it knows the root this well
  // While all trials lie on one side of the aim:
  double longest = std::numeric_limits<double>::infinity();  ///< step
  /// Steps follow the slope of the last two trials. It serves where the usual slope is known badly; where trials differ
  /// by little more than chance, as when a frame is rounded again, it costs trials.
  bool learnsSlope = false;
};

/// Follows a usual slope while all trials lie on one side of the aim, and then interpolates between the nearest trials on
/// both sides. Figures need not be quite monotone.
class RootSearch {
 public:
  /// \param slope  usual growth of the figure with x, above 0
  /// \param first  the first x that is tried
  RootSearch(const RootRange& range, double aim, double slope, double first)
      : aim_(aim),
        slope_(slope),
        next_(std::clamp(first, range.low, range.high)),
        narrowest_(range.narrowest),
        longest_(range.longest),
        learnsSlope_(range.learnsSlope),
        low_{range.low - range.narrowest},
        high_{range.high + range.narrowest} {}

  /// The x to try next.
  [[nodiscard]] double next() const { return next_; }
  [[nodiscard]] bool ended() const { return high_.x - low_.x < narrowest_; }

  /// Takes the figure at next().
  void learn(double figure) {
    const bool isLow = figure < aim_;
    repeats_ = isLow == wasLow_ ? repeats_ + 1 : 0;
    wasLow_ = isLow;
    const Side before = isLow ? low_ : high_;
    (isLow ? low_ : high_) = {next_, figure};
    const double width = high_.x - low_.x;
    const bool between = low_.known() && high_.known();
    double share = 0.5;
    if (between)
      share = (aim_ - low_.figure) / (high_.figure - low_.figure);
    else if (std::isfinite(figure))
      share = (next_ + stepFor(kOvershoot * (aim_ - figure) / slopeFrom(before, figure)) - low_.x) /
              width;
    // Where the figure jumps, interpolation would approach the jump from one side for a long time.
    if (repeats_ >= kMaxRepeats && between) share = isLow ? 0.5 * (1.0 + share) : 0.5 * share;
    next_ = low_.x + width * std::clamp(share, kInside, 1.0 - kInside);
  }

 private:
  struct Side {
    double x, figure = std::numeric_limits<double>::quiet_NaN();
    [[nodiscard]] bool known() const { return std::isfinite(figure); }
  };

  [[nodiscard]] double stepFor(double wanted) const {
    return std::clamp(wanted, -longest_, longest_);
  }

  /// The slope from an earlier trial to the last one, in so far as it is near the usual one.
  [[nodiscard]] double slopeFrom(const Side& before, double figure) const {
    constexpr double kMostFactor = 3.0;
    if (!learnsSlope_ || !before.known() || before.x == next_) return slope_;
    const double slope = (figure - before.figure) / (next_ - before.x);
    return std::clamp(slope, slope_ / kMostFactor, slope_ * kMostFactor);
  }

  static constexpr double kOvershoot = 1.1;  // so that the aim comes to lie between two trials
  static constexpr double kInside = 0.02;    // distance from both sides, relative to the interval
  static constexpr int kMaxRepeats = 2;      // repeated trials on a side, then steps are longer

  double aim_, slope_, next_, narrowest_, longest_;
  bool learnsSlope_;
  bool wasLow_ = false;  ///< whether the last trial was below the aim
  int repeats_ = 0;      ///< number of trials directly before the last one on its side of the aim
  Side low_, high_;
};

}  // namespace esvr::encode
