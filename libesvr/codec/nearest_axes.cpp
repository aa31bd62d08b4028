#include "codec/nearest_axes.h"

#include <algorithm>
#include <cmath>

#include "codec/lattice_bits.h"

namespace esvr {
namespace {

double dot(const Quaternion& a, const Quaternion& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/// The rotation and the three that differ from it by half turns about the axes.
std::array<Quaternion, 4> sameEllipsoid(const Quaternion& q) {
  return {Quaternion{q[0], q[1], q[2], q[3]}, Quaternion{-q[1], q[0], q[3], -q[2]},
          Quaternion{-q[2], -q[3], q[0], q[1]}, Quaternion{-q[3], q[2], -q[1], q[0]}};
}

/// True if the components x, y and z lie in the interval that has codes.
bool hasCodes(const Quaternion& q) {
  return std::max({std::abs(q[1]), std::abs(q[2]), std::abs(q[3])}) <= kRotationSide / 2.0;
}

}  // namespace

NearestAxes::NearestAxes(const Ellipsoids& e, std::size_t i, const Quaternion& before)
    : axes_(sortedAxes(e, i)) {
  double nearest = std::abs(dot(axes_.rotation, before));
  for (Quaternion turned : sameEllipsoid(axes_.rotation)) {
    if (turned[0] < 0.0)
      for (double& c : turned) c = -c;
    const double alike = dot(turned, before);
    if (!hasCodes(turned) || alike <= nearest) continue;
    nearest = alike;
    axes_.rotation = turned;
  }
}

Matrix3 NearestAxes::covarianceAlong(const Quaternion& rotation) const {
  const Matrix3 own = rotationOf(axes_.rotation), other = rotationOf(rotation);
  Matrix3 m{};  // R_other^T R diag(s)
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < 3; ++k) m[3 * r + c] += other[3 * k + r] * own[3 * k + c];
      m[3 * r + c] *= std::exp(axes_.logScale[c]);
    }
  Matrix3 covariance{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) covariance[3 * r + c] += m[3 * r + k] * m[3 * c + k];
  return covariance;
}

std::array<double, 3> NearestAxes::logScalesAlong(const Quaternion& rotation) const {
  const Matrix3 covariance = covarianceAlong(rotation);
  std::array<double, 3> logs{};
  for (std::size_t k = 0; k < 3; ++k) logs[k] = 0.5 * std::log(covariance[4 * k]);
  logs[1] = std::max(logs[1], logs[2]);
  logs[0] = std::max(logs[0], logs[1]);
  return logs;
}

double NearestAxes::squaredError(const std::array<double, 3>& logScale,
                                 const Quaternion& rotation) const {
  const Matrix3 covariance = covarianceAlong(rotation);
  double sum = 0.0;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      const double unit = covariance[3 * r + c] * std::exp(-logScale[r] - logScale[c]);
      const double error = unit - (r == c ? 1.0 : 0.0);
      sum += error * error;
    }
  return sum / 4.0;
}

}  // namespace esvr
