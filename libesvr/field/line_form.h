#pragma once
/// An ellipsoid prepared for evaluation along lines parallel to y.
///
/// Let L = S^-1 R^T (or Q L with any rotation Q), with the columns Lx, Ly, Lz, and d = x - mu, so
/// that m = |L d|^2. On a line with given dx and dz, the point closest to the center is at
/// dy = y* = sx dx + sz dz. With t = dy - y*,
///
///     m = |px dx + pz dz|^2 + a t^2
///     a = |Ly|^2,  px = Lx - Ly (Lx.Ly) / a,  pz = Lz - Ly (Lz.Ly) / a
///
/// Both terms are non-negative, so there is no cancellation, and float32 is precise enough for very
/// thin ellipsoids too. A voxel takes one multiply-add. The coefficients are computed in float64.

#include <array>
#include <cmath>
#include <cstddef>

#include "core/geometry.h"
#include "esvr/ellipsoids.h"

namespace esvr {

struct LineForm {
  std::array<float, 3> center;  ///< voxels in the frame of the caller
  std::array<float, 3> px, pz;  ///< parts of Lx and Lz that are perpendicular to Ly
  std::array<float, 3> ly;      ///< column of L along y
  float sx, sz;                 ///< slopes of y*
  float a;                      ///< |Ly|^2
  float halfX;                  ///< half width of the support's bounding box along x
  /// The support's extent along y in the plane dx is slopeYx dx +- halfYx sqrt(1 - (dx / halfX)^2).
  float slopeYx, halfYx;
  float intensity;
};

/// Sigma_ij, which is the product of the rows i and j of F.
[[nodiscard]] ESVR_HD inline double sigma(const Matrix3& F, int i, int j) {
  return F[3 * i] * F[3 * j] + F[3 * i + 1] * F[3 * j + 1] + F[3 * i + 2] * F[3 * j + 2];
}

namespace line_form {

using Vec3 = std::array<double, 3>;

ESVR_HD inline double dot(const Vec3& u, const Vec3& v) {
  return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}
ESVR_HD inline std::array<float, 3> projectedOff(const Vec3& v, const Vec3& axis,
                                                 double coefficient) {
  return {float(v[0] - axis[0] * coefficient), float(v[1] - axis[1] * coefficient),
          float(v[2] - axis[2] * coefficient)};
}

/// Half width along y of the section of the ellipsoid |L d| = 1 by the plane dx = 0.
ESVR_HD inline double conditionalSigmaY(const Vec3& ly, const Vec3& lz) {
  // Its square is Sigma_yy - Sigma_xy^2 / Sigma_xx, the variance of y for a given x. It equals
  // 1 / (Ly.Ly - (Ly.Lz)^2 / Lz.Lz), which has less cancellation.
  const double c = dot(ly, lz) / dot(lz, lz);
  const Vec3 off{ly[0] - lz[0] * c, ly[1] - lz[1] * c, ly[2] - lz[2] * c};
  return 1.0 / std::sqrt(dot(off, off));
}

}  // namespace line_form

/// The inverse F = L^-1. Its columns are the axes times their scales, up to a rotation.
[[nodiscard]] ESVR_HD inline Matrix3 inverse(const Matrix3& m) {
  const double c00 = m[4] * m[8] - m[5] * m[7], c01 = m[5] * m[6] - m[3] * m[8],
               c02 = m[3] * m[7] - m[4] * m[6];
  const double s = 1.0 / (m[0] * c00 + m[1] * c01 + m[2] * c02);
  return {c00 * s, (m[2] * m[7] - m[1] * m[8]) * s, (m[1] * m[5] - m[2] * m[4]) * s,
          c01 * s, (m[0] * m[8] - m[2] * m[6]) * s, (m[2] * m[3] - m[0] * m[5]) * s,
          c02 * s, (m[1] * m[6] - m[0] * m[7]) * s, (m[0] * m[4] - m[1] * m[3]) * s};
}

/// \param L       maps displacements to the unit frame
/// \param radius  radius of the support in the unit frame (supportRadius)
[[nodiscard]] ESVR_HD inline LineForm makeLineForm(const std::array<double, 3>& center,
                                                   const Matrix3& L, double radius,
                                                   double intensity) {
  using namespace line_form;
  const Vec3 lx = columnOf(L, 0), ly = columnOf(L, 1), lz = columnOf(L, 2);
  const double a = dot(ly, ly), cx = dot(lx, ly) / a, cz = dot(lz, ly) / a;
  const Matrix3 F = inverse(L);
  const double sxx = sigma(F, 0, 0);
  LineForm f;
  f.center = {float(center[0]), float(center[1]), float(center[2])};
  f.px = projectedOff(lx, ly, cx);
  f.pz = projectedOff(lz, ly, cz);
  f.ly = {float(ly[0]), float(ly[1]), float(ly[2])};
  f.sx = float(-cx), f.sz = float(-cz), f.a = float(a);
  f.halfX = float(radius * std::sqrt(sxx));
  f.slopeYx = float(sigma(F, 0, 1) / sxx);
  f.halfYx = float(radius * conditionalSigmaY(ly, lz));
  f.intensity = float(intensity);
  return f;
}

/// An ellipsoid prepared for the evaluation of bricks with SIMD. Its support is
///
///     (dx / halfX)^2 + ((dy - slopeYx dx) / halfYx)^2 + ((dz - slopeZx dx - slopeZy dy) / halfZ)^2 < 1
///
/// with the half width halfZ along z for given x and y. The first two terms and the smallest third
/// one in a range of z decide whether a row along z meets the support. All half widths are those of
/// the support and a hundredth of a voxel more, because of rounding.
struct BrickForm : LineForm {
  float inverseX, inverseY, inverseZ;  ///< 1 / halfX, 1 / halfYx, 1 / halfZ
  float yByX;                          ///< slopeYx / halfYx
  float zByX, zByY;                    ///< slopeZx / halfZ, slopeZy / halfZ
};

/// The parameters are those of makeLineForm().
[[nodiscard]] inline BrickForm makeBrickForm(const std::array<double, 3>& center, const Matrix3& L,
                                             double radius, double intensity) {
  using namespace line_form;
  const Vec3 lx = columnOf(L, 0), ly = columnOf(L, 1), lz = columnOf(L, 2);
  const double zz = dot(lz, lz);
  const auto inverseOf = [](double half) { return 1.0 / (half * (1.0 + 1e-6) + 0.01); };
  BrickForm f{makeLineForm(center, L, radius, intensity), {}, {}, {}, {}, {}, {}};
  const double y = inverseOf(f.halfYx), z = inverseOf(radius / std::sqrt(zz));
  f.inverseX = float(inverseOf(f.halfX));
  f.inverseY = float(y);
  f.inverseZ = float(z);
  f.yByX = float(f.slopeYx * y);
  f.zByX = float(-dot(lx, lz) / zz * z);
  f.zByY = float(-dot(ly, lz) / zz * z);
  return f;
}

/// The matrix L = S^-1 R^T of ellipsoid i, which maps a displacement d to u = L d.
[[nodiscard]] inline Matrix3 unitFrame(const Ellipsoids& e, std::size_t i) {
  const Quaternion q{e.rotation[0][i], e.rotation[1][i], e.rotation[2][i], e.rotation[3][i]};
  const Matrix3 R = rotationOf(normalised(q));
  Matrix3 L;
  for (int r = 0; r < 3; ++r) {
    const double inv = std::exp(-double(e.logScale[r][i]));
    for (int c = 0; c < 3; ++c) L[3 * r + c] = inv * R[3 * c + r];
  }
  return L;
}

// The math for each voxel, which gives m. It serves SIMD vectors and CUDA: T is float or a vector of
// floats, and so is X, the type of dx, which is the same for all voxels of a line. The functions are
// static, so that each translation unit keeps its own copy for its instruction set. Otherwise the
// linker could keep one copy for all of them.

/// m at the point of the line (dx, dz) that is closest to the center. No voxel of the line has a
/// smaller m.
/// \param pzDz  pz * dz
template <class T, class X>
ESVR_HD static inline T closestSquared(const LineForm& f, X dx, const T (&pzDz)[3]) {
  const T u0 = pzDz[0] + dx * f.px[0], u1 = pzDz[1] + dx * f.px[1], u2 = pzDz[2] + dx * f.px[2];
  return u0 * u0 + u1 * u1 + u2 * u2;
}

/// The distance t from the closest point to y.
/// \param centerY  y of the center, in the frame of y
template <class T, class X>
ESVR_HD static inline T distanceAlong(const LineForm& f, T y, float centerY, X dx, T dz) {
  return y - (dx * f.sx + centerY) - dz * f.sz;
}

/// m at t. \param closest  m at the closest point
template <class T>
ESVR_HD static inline T squaredAt(const LineForm& f, T closest, T t) {
  return closest + f.a * t * t;
}

}  // namespace esvr
