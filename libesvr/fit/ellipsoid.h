#pragma once
/// The form of an ellipsoid during a fit, its moves, and its conversion to and from a Field. The
/// arithmetic is for host and device.
///
/// Its shape is L, any matrix with Sigma^-1 = L^T L. Steps are taken in the unit frame of the
/// ellipsoid: mu += F delta with F = L^-1, and L <- exp(-A) L with A symmetric. A step of a given
/// size thus changes any ellipsoid by the same fraction of itself. Spheres, where a rotation has no
/// gradient, need no special treatment.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "field/line_form.h"

#if defined(__CUDACC__)
// Eigen annotates defaulted members, which nvcc warns about.
#pragma nv_diagnostic push
#pragma nv_diag_suppress 20012
#endif
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#if defined(__CUDACC__)
#pragma nv_diagnostic pop
#endif

namespace esvr {

struct Ellipsoid {
  std::array<double, 3> center;  ///< voxels relative to the volume's origin
  Matrix3 L;
  double intensity;  ///< units of the target (FitTarget::scale)
};

/// A gradient or a step in an ellipsoid's own frame. The order is delta (3), A as xx yy zz xy xz yz
/// (6), intensity (1).
inline constexpr int kParameters = 10;
using ParameterVector = std::array<double, kParameters>;

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

/// Origin of the chunk that contains a position. Float32 positions are relative to such an integer
/// frame, so that their precision does not depend on the extent of the grid.
ESVR_HD inline Coord frameOf(const std::array<double, 3>& center) {
  const auto snap = [](double v) {
    return std::int32_t(std::floor(v / kChunkExtent)) * kChunkExtent;
  };
  return {snap(center[0]), snap(center[1]), snap(center[2])};
}

ESVR_HD inline std::array<double, 3> inFrame(const std::array<double, 3>& center, Coord frame) {
  return {center[0] - frame.x, center[1] - frame.y, center[2] - frame.z};
}

ESVR_HD inline std::array<float, 3> cornerIn(Coord frame, Coord corner) {
  const Coord local = corner - frame;
  return {float(local.x), float(local.y), float(local.z)};
}

/// Principal axes of L: the scales and the rotation with L = Q S^-1 R^T, as Ellipsoids store them.
struct PrincipalAxes {
  std::array<double, 3> scale;     ///< decreasing
  std::array<double, 4> rotation;  ///< unit quaternion w, x, y, z, w >= 0
};
[[nodiscard]] PrincipalAxes principalAxes(const Matrix3& L);

struct ExportFrame {
  Coord origin;        ///< origin of the volume, index coordinates
  double scale = 1.0;  ///< see FitTarget::scale
  float background = 0.0f;
  Kernel kernel;
  std::span<const double> kappas{};  ///< kappa of each ellipsoid; empty if all share the kernel's
};

/// Computes principal axes, log scales and intensities in the grid's units, and sorts the
/// ellipsoids into chunks of kChunkExtent.
[[nodiscard]] Field exportField(std::span<const Ellipsoid> ellipsoids, const ExportFrame& frame);

/// The ellipsoids of all chunks, in their order; the inverse of exportField().
/// \param origin  origin of the volume, index coordinates
/// \param scale   see FitTarget::scale
[[nodiscard]] std::vector<Ellipsoid> importField(const Field& field, Coord origin, double scale);

}  // namespace esvr
