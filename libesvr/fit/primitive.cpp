#include "fit/primitive.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace esvr {
namespace {

using Eigen::Matrix3d;
using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Eigen::Map<const RowMajor> asEigen(const Matrix3& m) {
  return Eigen::Map<const RowMajor>(m.data());
}

void assign(Matrix3& to, const Matrix3d& from) { Eigen::Map<RowMajor>(to.data()) = from; }

/// exp(-A) to second order: steps are a few hundredths, and any L is a valid shape.
Matrix3d shrink(const ParameterVector& s) {
  Matrix3d A;
  A << s[3], s[6], s[7], s[6], s[4], s[8], s[7], s[8], s[5];
  return Matrix3d::Identity() - A + 0.5 * A * A;
}

/// Squared Frobenius norm: bounds the largest singular value from above.
double norm2(const Matrix3& m) { return asEigen(m).squaredNorm(); }

}  // namespace

void applyStep(Primitive& p, const ParameterVector& step) {
  const Matrix3 F = inverse(p.L);
  for (int r = 0; r < 3; ++r)
    p.center[r] += F[3 * r] * step[0] + F[3 * r + 1] * step[1] + F[3 * r + 2] * step[2];
  assign(p.L, shrink(step) * asEigen(p.L));
  p.intensity += step[9];
}

void clampScales(Primitive& p, double smallest, double largest) {
  const bool noneTooSmall = norm2(p.L) <= 1.0 / (smallest * smallest);
  if (noneTooSmall && norm2(inverse(p.L)) <= largest * largest) return;
  // L = U D V^T: the eigenvectors of L^T L are V, and L V diag(f) V^T scales D by f. The
  // closed-form solver is quick and keeps six digits of the longest scale at an aspect of 1000: a
  // limit needs less.
  const Matrix3d L = asEigen(p.L);
  Eigen::SelfAdjointEigenSolver<Matrix3d> axes;
  axes.computeDirect(L.transpose() * L);
  Eigen::Vector3d factor;
  for (int a = 0; a < 3; ++a) {
    const double d = std::sqrt(std::max(axes.eigenvalues()[a], 1e-300));
    factor[a] = std::clamp(d, 1.0 / largest, 1.0 / smallest) / d;
  }
  const Matrix3d& V = axes.eigenvectors();
  assign(p.L, L * V * factor.asDiagonal() * V.transpose());
}

PrincipalAxes principalAxes(const Matrix3& L) {
  const Eigen::JacobiSVD<Matrix3d> svd(asEigen(L), Eigen::ComputeFullV);
  const Eigen::Vector3d s = svd.singularValues();
  // Singular values of L decrease, so scales increase: reverse for the longest axis first.
  Matrix3d R = svd.matrixV().rowwise().reverse();
  if (R.determinant() < 0.0) R.col(2) = -R.col(2);
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return {{1.0 / s[2], 1.0 / s[1], 1.0 / s[0]}, {q.w(), q.x(), q.y(), q.z()}};
}

}  // namespace esvr
