#include "fit/kappa_descent.h"

#include <algorithm>
#include <cmath>

namespace esvr {
namespace {

// The averages are short, because there are few steps and every relocation changes the slope.
constexpr double kBeta1 = 0.7, kBeta2 = 0.9;

}  // namespace

float KappaDescent::next(float kappa, double slope, double factor) {
  if (slope == 0.0) return kappa;
  mean_ = kBeta1 * mean_ + (1.0 - kBeta1) * slope;
  square_ = kBeta2 * square_ + (1.0 - kBeta2) * slope * slope;
  meanWeight_ = kBeta1 * meanWeight_ + (1.0 - kBeta1);
  squareWeight_ = kBeta2 * squareWeight_ + (1.0 - kBeta2);
  const double direction = mean_ / meanWeight_ / std::sqrt(square_ / squareWeight_);
  return float(std::clamp(kappa - factor * largestStep_ * direction, kSmoothest, kHardest));
}

}  // namespace esvr
