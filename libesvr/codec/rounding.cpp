#include "codec/rounding.h"

#include <algorithm>
#include <cmath>

#include "core/rotation.h"

namespace esvr {
namespace {

using Covariance = std::array<std::array<double, 3>, 3>;

/// Smallest weight of a turn about one axis, relative to the largest one. A ball may turn freely.
constexpr double kMinTurn = 1.0 / 32.0;

/// M diag(variance) M^T.
Covariance covarianceOf(const Matrix3& m, const std::array<double, 3>& variance) {
  Covariance c{};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      for (std::size_t k = 0; k < 3; ++k)
        c[row][column] += m[3 * row + k] * variance[k] * m[3 * column + k];
  return c;
}

/// The squared error that a small turn causes which mixes two axes, relative to its angle squared
/// and to the ellipsoid's weight.
double turnWeight(double logA, double logB) {
  const double root = 2.0 * std::sinh(std::abs(logA - logB));
  return root * root;
}

}  // namespace

CoupledErrors::CoupledErrors(const Covariance& covariance) : covariance_(covariance) {
  const auto& c = covariance_;
  const double determinant = c[0][0] * c[1][1] - c[0][1] * c[0][1];
  if (!(determinant > 0.0)) return;  // one coordinate follows the other: there is nothing to gain
  last_[0] = (c[0][2] * c[1][1] - c[1][2] * c[0][1]) / determinant;
  last_[1] = (c[1][2] * c[0][0] - c[0][2] * c[0][1]) / determinant;
}

double CoupledErrors::shift(std::size_t a, const std::array<double, 3>& error) const {
  if (a == 0) return 0.0;
  if (a == 1) return covariance_[0][1] / covariance_[0][0] * error[0];
  return last_[0] * error[0] + last_[1] * error[1];
}

CoupledErrors centerErrors(const SortedAxes& axes) {
  std::array<double, 3> variance{};
  for (std::size_t k = 0; k < 3; ++k)
    variance[k] = std::exp(2.0 * (axes.logScale[k] - axes.logScale[2]));
  return CoupledErrors(covarianceOf(rotationOf(axes.rotation), variance));
}

CoupledErrors rotationErrors(const SortedAxes& axes) {
  const auto [w, x, y, z] = axes.rotation;
  const auto& log = axes.logScale;
  const double largest = std::max(turnWeight(log[0], log[2]), 1e-300);
  std::array<double, 3> variance{};
  const double weights[] = {turnWeight(log[1], log[2]), largest, turnWeight(log[0], log[1])};
  for (std::size_t k = 0; k < 3; ++k)
    variance[k] = 1.0 / std::max(weights[k] / largest, kMinTurn * kMinTurn);
  // A small turn by d about the ellipsoid's axes changes (x, y, z) by M d / 2.
  return CoupledErrors(covarianceOf({w, -z, y, z, w, -x, -y, x, w}, variance));
}

}  // namespace esvr
