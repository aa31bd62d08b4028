#pragma once
/// Descends on the kernel's edge, which all ellipsoids share.

#include "esvr/kernel.h"

namespace esvr {

/// Adam on one number whose gradient is of any size.
class KappaDescent {
 public:
  /// \param largestStep  of one call
  explicit KappaDescent(double largestStep) : largestStep_(largestStep) {}

  /// \param slope   dL/dkappa at `kappa`
  /// \param factor  of the step's size
  /// \return the next kappa, within [kSmoothest, kHardest]
  [[nodiscard]] float next(float kappa, double slope, double factor);

  /// Beyond the first a kernel is a Gaussian to float32's eye, beyond the second a step.
  static constexpr double kSmoothest = -8.0, kHardest = 30.0;

 private:
  double largestStep_;
  double mean_ = 0.0, square_ = 0.0;
  double meanWeight_ = 0.0, squareWeight_ = 0.0;
};

}  // namespace esvr
