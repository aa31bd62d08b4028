#pragma once
/// Gradient descent on the kernel's edge, which all ellipsoids share.

#include "esvr/kernel.h"

namespace esvr {

/// Adam on a single parameter.
class KappaDescent {
 public:
  /// \param largestStep  largest change of kappa by one call
  explicit KappaDescent(double largestStep) : largestStep_(largestStep) {}

  /// \param slope   dL/dkappa at `kappa`
  /// \param factor  factor of the step's size
  /// \return the next kappa, within [kSmoothest, kHardest]
  [[nodiscard]] float next(float kappa, double slope, double factor);

  /// Below the first limit the kernel is a Gaussian in float32, above the second it is a step.
  static constexpr double kSmoothest = -8.0, kHardest = 30.0;

 private:
  double largestStep_;
  double mean_ = 0.0, square_ = 0.0;
  double meanWeight_ = 0.0, squareWeight_ = 0.0;
};

}  // namespace esvr
