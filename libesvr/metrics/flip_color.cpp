#include "metrics/flip_color.h"

#include <cmath>

namespace esvr::metrics {
namespace {

using Matrix = std::array<Color, 3>;  // rows

/// Matrix from linear RGB to XYZ for sRGB's primaries and D65.
constexpr Matrix kXyzFromRgb{{
    {10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0},
    {2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0},
    {1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0},
}};

constexpr Color times(const Matrix& m, const Color& v) {
  Color result{};
  for (int row = 0; row < 3; ++row)
    result[row] = m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2];
  return result;
}

/// XYZ of white, RGB (1, 1, 1).
constexpr Color kWhite = times(kXyzFromRgb, {1.0, 1.0, 1.0});

/// Cofactor of an entry. Rows and columns are taken cyclically, which gives the right sign.
constexpr double cofactor(const Matrix& m, int row, int column) {
  const int r1 = (row + 1) % 3, r2 = (row + 2) % 3;
  const int c1 = (column + 1) % 3, c2 = (column + 2) % 3;
  return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
}

constexpr Matrix inverse(const Matrix& m) {
  double determinant = 0.0;
  for (int i = 0; i < 3; ++i) determinant += m[0][i] * cofactor(m, 0, i);
  Matrix result{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      result[row][column] = cofactor(m, column, row) / determinant;
  return result;
}

constexpr Matrix kRgbFromXyz = inverse(kXyzFromRgb);

Color relativeToWhite(const Color& xyz) {
  return {xyz[0] / kWhite[0], xyz[1] / kWhite[1], xyz[2] / kWhite[2]};
}

/// Converts three stimuli to lightness and two opponent colors, and back.
Color opponent(const Color& v) {
  return {116.0 * v[1] - 16.0, 500.0 * (v[0] - v[1]), 200.0 * (v[1] - v[2])};
}
Color stimuli(const Color& opponentColor) {
  const double y = (opponentColor[0] + 16.0) / 116.0;
  return {y + opponentColor[1] / 500.0, y, y - opponentColor[2] / 200.0};
}

/// CIE's cube root, which is linear near black.
double lightness(double v) {
  constexpr double kDelta = 6.0 / 29.0;
  return v > kDelta * kDelta * kDelta ? std::cbrt(v) : v / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
}

double linearOf(double srgb) {
  return srgb > 0.04045 ? std::pow((srgb + 0.055) / 1.055, 2.4) : srgb / 12.92;
}

}  // namespace

Color linearFromSrgb(const Color& c) { return {linearOf(c[0]), linearOf(c[1]), linearOf(c[2])}; }

Color ycxczFromLinear(const Color& linear) {
  return opponent(relativeToWhite(times(kXyzFromRgb, linear)));
}

Color linearFromYcxcz(const Color& ycxcz) {
  const Color v = stimuli(ycxcz);
  return times(kRgbFromXyz, {v[0] * kWhite[0], v[1] * kWhite[1], v[2] * kWhite[2]});
}

Color huntLabFromLinear(const Color& linear) {
  const Color v = relativeToWhite(times(kXyzFromRgb, linear));
  const Color lab = opponent({lightness(v[0]), lightness(v[1]), lightness(v[2])});
  return {lab[0], 0.01 * lab[0] * lab[1], 0.01 * lab[0] * lab[2]};
}

double hyab(const Color& a, const Color& b) {
  return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

}  // namespace esvr::metrics
