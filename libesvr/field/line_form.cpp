#include "field/line_form.h"

#include <cmath>

namespace esvr {
namespace {

using Vec3 = std::array<double, 3>;

Vec3 column(const Matrix3& m, int c) { return {m[c], m[3 + c], m[6 + c]}; }
double dot(const Vec3& u, const Vec3& v) { return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]; }

std::array<float, 3> projectedOff(const Vec3& v, const Vec3& axis, double coefficient) {
  return {float(v[0] - axis[0] * coefficient), float(v[1] - axis[1] * coefficient),
          float(v[2] - axis[2] * coefficient)};
}

/// (row i of F) . (row j of F) = Sigma_ij.
double sigma(const Matrix3& F, int i, int j) {
  return F[3 * i] * F[3 * j] + F[3 * i + 1] * F[3 * j + 1] + F[3 * i + 2] * F[3 * j + 2];
}

/// Half width in y of the support's section through its center by the plane x = const.
double conditionalSigmaY(const Matrix3& L) {
  // Variance of y given x in the unit frame: Sigma_yy - Sigma_xy^2 / Sigma_xx without cancellation
  // is 1 / (Ly.Ly - (Ly.Lz)^2 / Lz.Lz), the y-y entry of the inverse of the 2x2 block of the
  // precision.
  const Vec3 ly = column(L, 1), lz = column(L, 2);
  const double c = dot(ly, lz) / dot(lz, lz);
  const Vec3 off{ly[0] - lz[0] * c, ly[1] - lz[1] * c, ly[2] - lz[2] * c};
  return 1.0 / std::sqrt(dot(off, off));
}

}  // namespace

Matrix3 inverse(const Matrix3& m) {
  const double c00 = m[4] * m[8] - m[5] * m[7], c01 = m[5] * m[6] - m[3] * m[8],
               c02 = m[3] * m[7] - m[4] * m[6];
  const double s = 1.0 / (m[0] * c00 + m[1] * c01 + m[2] * c02);
  return {c00 * s, (m[2] * m[7] - m[1] * m[8]) * s, (m[1] * m[5] - m[2] * m[4]) * s,
          c01 * s, (m[0] * m[8] - m[2] * m[6]) * s, (m[2] * m[3] - m[0] * m[5]) * s,
          c02 * s, (m[1] * m[6] - m[0] * m[7]) * s, (m[0] * m[4] - m[1] * m[3]) * s};
}

Matrix3 unitFrame(const Ellipsoids& e, std::size_t i) {
  double w = e.rotation[0][i], x = e.rotation[1][i], y = e.rotation[2][i], z = e.rotation[3][i];
  const double norm = 1.0 / std::sqrt(w * w + x * x + y * y + z * z);
  w *= norm, x *= norm, y *= norm, z *= norm;
  const Matrix3 R{1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                  2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                  2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  Matrix3 L;
  for (int r = 0; r < 3; ++r) {
    const double inv = std::exp(-double(e.logScale[r][i]));
    for (int c = 0; c < 3; ++c) L[3 * r + c] = inv * R[3 * c + r];
  }
  return L;
}

LineForm makeLineForm(const std::array<double, 3>& center, const Matrix3& L, double radius,
                      double intensity) {
  const Vec3 lx = column(L, 0), ly = column(L, 1), lz = column(L, 2);
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
  f.halfYx = float(radius * conditionalSigmaY(L));
  f.intensity = float(intensity);
  return f;
}

}  // namespace esvr
