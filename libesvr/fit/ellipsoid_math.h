#pragma once
/// Steps of one ellipsoid (ellipsoid.h), for host and device.

#include <algorithm>
#include <cmath>

#include "fit/eigen.h"
#include "fit/ellipsoid.h"

namespace esvr {
namespace ellipsoid_math {

using Eigen::Matrix3d;
using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

ESVR_HD inline Eigen::Map<const RowMajor> asEigen(const Matrix3& m) {
  return Eigen::Map<const RowMajor>(&m[0]);
}

ESVR_HD inline void assign(Matrix3& to, const Matrix3d& from) {
  Eigen::Map<RowMajor> values(&to[0]);
  values = from;
}

/// exp(-A) to second order, which suffices since steps are a few hundredths and any L is valid.
ESVR_HD inline Matrix3d shrink(const ParameterVector& s) {
  Matrix3d A;
  A(0, 0) = s[3], A(1, 1) = s[4], A(2, 2) = s[5];
  A(0, 1) = A(1, 0) = s[6];
  A(0, 2) = A(2, 0) = s[7];
  A(1, 2) = A(2, 1) = s[8];
  return Matrix3d::Identity() - A + 0.5 * A * A;
}

/// Squared Frobenius norm, an upper bound of the largest singular value's square.
ESVR_HD inline double norm2(const Matrix3& m) { return asEigen(m).squaredNorm(); }

}  // namespace ellipsoid_math

/// Moves an ellipsoid by a step.
ESVR_HD inline void applyStep(Ellipsoid& p, const ParameterVector& step) {
  using namespace ellipsoid_math;
  const Matrix3 F = inverse(p.L);
  for (int r = 0; r < 3; ++r)
    p.center[r] += F[3 * r] * step[0] + F[3 * r + 1] * step[1] + F[3 * r + 2] * step[2];
  const Matrix3d moved = shrink(step) * asEigen(p.L);
  assign(p.L, moved);
  p.intensity += step[9];
}

/// Divides every scale by a factor.
ESVR_HD inline void shrinkBy(Ellipsoid& p, double factor) {
  for (double& l : p.L) l *= factor;
}

/// Clamps every scale to [smallest, largest] voxels and keeps the frame.
ESVR_HD inline void clampScales(Ellipsoid& p, double smallest, double largest) {
  using namespace ellipsoid_math;
  const bool noneTooSmall = norm2(p.L) <= 1.0 / (smallest * smallest);
  if (noneTooSmall && norm2(inverse(p.L)) <= largest * largest) return;
  // L = U D V^T: the eigenvectors of L^T L are V, and L V diag(f) V^T scales D by f. The
  // closed-form solver is fast; at an aspect ratio of 1000 the longest scale has six correct
  // digits, which is enough for a limit.
  const Matrix3d L = asEigen(p.L);
  Eigen::SelfAdjointEigenSolver<Matrix3d> axes;
  axes.computeDirect(L.transpose() * L);
  Eigen::Vector3d factor;
  for (int a = 0; a < 3; ++a) {
    const double square = axes.eigenvalues()[a];
    const double d = std::sqrt(square > 1e-300 ? square : 1e-300);
    factor[a] = std::clamp(d, 1.0 / largest, 1.0 / smallest) / d;
  }
  const Matrix3d V = axes.eigenvectors();
  const Matrix3d clamped = L * V * factor.asDiagonal() * V.transpose();
  assign(p.L, clamped);
}

}  // namespace esvr
