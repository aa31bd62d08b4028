#include "fit/ellipsoid.h"

#include <Eigen/Dense>

#include "fit/ellipsoid_math.h"

namespace esvr {

using Eigen::Matrix3d;
using ellipsoid_math::asEigen;

PrincipalAxes principalAxes(const Matrix3& L) {
  const Eigen::JacobiSVD<Matrix3d> svd(asEigen(L), Eigen::ComputeFullV);
  const Eigen::Vector3d s = svd.singularValues();
  // The singular values of L decrease and the scales increase; the longest axis must come first.
  Matrix3d R = svd.matrixV().rowwise().reverse();
  if (R.determinant() < 0.0) R.col(2) = -R.col(2);
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return {{1.0 / s[2], 1.0 / s[1], 1.0 / s[0]}, {q.w(), q.x(), q.y(), q.z()}};
}

}  // namespace esvr
