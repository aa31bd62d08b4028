#pragma once
/// Scales all steps down when they overshoot together. Ellipsoids that overlap see the same
/// residual and move alike; where many do, their sum overshoots although each step is small.

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/kernel.h"

namespace esvr {

class StepTrust {
 public:
  /// \param energy  sum of squares of the target: losses far below it may jump without harm
  ESVR_HD explicit StepTrust(double energy = 0.0) : noise_(kNoise * energy) {}

  /// \param loss  of the iteration just evaluated \return the factor for its step
  ESVR_HD double update(double loss) {
    const bool rising = loss > previous_;
    previous_ = loss;
    if (rising && loss > kBadly * std::max(best_, noise_))
      factor_ = std::fmax(kLeast, factor_ * kCut);
    else
      factor_ = std::min(1.0, factor_ * kRecover);
    best_ = std::min(loss, best_ * kForget);
    return factor_;
  }
  /// After primitives were added or moved, which may raise the loss.
  ESVR_HD void forgetLoss() { best_ = previous_ = std::numeric_limits<double>::max(); }

 private:
  static constexpr double kBadly =
      10.0;  ///< rise over the recent best that counts as overshoot, not as noise
  static constexpr double kNoise = 1e-3;
  static constexpr double kCut = 0.6;
  static constexpr double kRecover = 1.04;
  static constexpr double kForget = 1.05;  ///< the best fades, so that the reference stays recent
  static constexpr double kLeast = 1e-3;

  double noise_;
  double best_ = std::numeric_limits<double>::max();
  double previous_ = std::numeric_limits<double>::max();
  double factor_ = 1.0;
};

}  // namespace esvr
