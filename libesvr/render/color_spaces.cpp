#include "render/color_spaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace esvr {
namespace {

using Triple = std::array<double, 3>;

Triple asTriple(const Rgb& c) { return {c.r, c.g, c.b}; }
Rgb asRgb(const Triple& c) {
  return {std::clamp(c[0], 0.0, 1.0), std::clamp(c[1], 0.0, 1.0), std::clamp(c[2], 0.0, 1.0)};
}
Triple line(const Triple& a, const Triple& b, double s) {
  return {(1 - s) * a[0] + s * b[0], (1 - s) * a[1] + s * b[1], (1 - s) * a[2] + s * b[2]};
}

// Hue, saturation, value.

double hueOf(const Rgb& c, double high, double range) {
  if (range == 0.0) return 0.0;
  const double sixth = high == c.r   ? (c.g - c.b) / range
                       : high == c.g ? 2.0 + (c.b - c.r) / range
                                     : 4.0 + (c.r - c.g) / range;
  return sixth < 0.0 ? sixth / 6.0 + 1.0 : sixth / 6.0;
}

Triple toHsv(const Rgb& c) {
  const double high = std::max({c.r, c.g, c.b}), range = high - std::min({c.r, c.g, c.b});
  return {hueOf(c, high, range), high == 0.0 ? 0.0 : range / high, high};
}

/// Channel n (5 red, 3 green, 1 blue) of a color in HSV.
double channel(const Triple& hsv, double n) {
  const double k = std::fmod(n + 6.0 * hsv[0], 6.0);
  return hsv[2] - hsv[2] * hsv[1] * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0);
}
Rgb fromHsv(const Triple& hsv) {
  return asRgb({channel(hsv, 5.0), channel(hsv, 3.0), channel(hsv, 1.0)});
}

Rgb mixedHsv(const Rgb& from, const Rgb& to, double s, bool wrap) {
  Triple a = toHsv(from), b = toHsv(to);
  if (wrap && std::abs(a[0] - b[0]) > 0.5) (a[0] > b[0] ? a : b)[0] -= 1.0;
  Triple hsv = line(a, b, s);
  if (hsv[0] < 0.0) hsv[0] += 1.0;
  return fromHsv(hsv);
}

// CIE L*a*b* (CIE 15:2004), computed through XYZ with the primaries of sRGB (IEC 61966-2-1) and
// the white point D65.

constexpr Triple kWhite{0.9505, 1.0, 1.089};

double linearised(double v) { return v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92; }
double gammaCoded(double v) {
  return v > 0.0031308 ? 1.055 * std::pow(v, 1.0 / 2.4) - 0.055 : 12.92 * v;
}

constexpr double kLabLimit = 6.0 / 29.0;
double labCurve(double t) {
  return t > kLabLimit * kLabLimit * kLabLimit ? std::cbrt(t)
                                               : t / (3 * kLabLimit * kLabLimit) + 4.0 / 29.0;
}
double labInverse(double t) {
  return t > kLabLimit ? t * t * t : 3 * kLabLimit * kLabLimit * (t - 4.0 / 29.0);
}

Triple toLab(const Rgb& c) {
  const double r = linearised(c.r), g = linearised(c.g), b = linearised(c.b);
  const double x = labCurve((0.4124 * r + 0.3576 * g + 0.1805 * b) / kWhite[0]);
  const double y = labCurve((0.2126 * r + 0.7152 * g + 0.0722 * b) / kWhite[1]);
  const double z = labCurve((0.0193 * r + 0.1192 * g + 0.9505 * b) / kWhite[2]);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

Rgb fromLab(const Triple& lab) {
  const double fy = (lab[0] + 16.0) / 116.0;
  const double x = kWhite[0] * labInverse(fy + lab[1] / 500.0);
  const double y = kWhite[1] * labInverse(fy);
  const double z = kWhite[2] * labInverse(fy - lab[2] / 200.0);
  return asRgb({gammaCoded(3.2406 * x - 1.5372 * y - 0.4986 * z),
                gammaCoded(-0.9689 * x + 1.8758 * y + 0.0415 * z),
                gammaCoded(0.0557 * x - 0.2040 * y + 1.0570 * z)});
}

// Moreland's color space Msh is the polar form of L*a*b*: a magnitude M, and two angles for the
// saturation s and the hue h.

constexpr double kPi = std::numbers::pi;
constexpr double kUnsaturated = 0.05;  ///< radians; a color with a smaller s counts as grey
constexpr double kWhiteMagnitude = 88.0;

Triple toMsh(const Rgb& c) {
  const Triple lab = toLab(c);
  const double m = std::hypot(lab[0], lab[1], lab[2]);
  const double s = m > 0.001 ? std::acos(std::min(lab[0] / m, 1.0)) : 0.0;
  return {m, s, s > 0.001 ? std::atan2(lab[2], lab[1]) : 0.0};
}
Rgb fromMsh(const Triple& msh) {
  const double chroma = msh[0] * std::sin(msh[1]);
  return fromLab({msh[0] * std::cos(msh[1]), chroma * std::cos(msh[2]), chroma * std::sin(msh[2])});
}

double angleBetween(double a, double b) {
  const double d = std::abs(a - b);
  return std::min(d, 2 * kPi - d);
}

/// The hue for a grey of magnitude m at the end of an interpolation from a saturated color. Its
/// choice makes the path straight in L*a*b*, and turns it away from purple (Moreland 2009).
double fadedHue(const Triple& saturated, double m) {
  if (saturated[0] >= m - 0.1) return saturated[2];
  const double turn = saturated[1] * std::sqrt(m * m - saturated[0] * saturated[0]) /
                      (saturated[0] * std::sin(saturated[1]));
  return saturated[2] > -0.3 * kPi ? saturated[2] + turn : saturated[2] - turn;
}

bool saturated(const Triple& msh) { return msh[1] > kUnsaturated; }

Rgb mixedDiverging(const Rgb& from, const Rgb& to, double s) {
  Triple a = toMsh(from), b = toMsh(to);
  if (saturated(a) && saturated(b) && angleBetween(a[2], b[2]) > kPi / 3) {
    const Triple white{std::max({a[0], b[0], kWhiteMagnitude}), 0.0, 0.0};
    (s < 0.5 ? b : a) = white;
    s = s < 0.5 ? 2 * s : 2 * s - 1;
  }
  if (!saturated(a) && saturated(b)) a[2] = fadedHue(b, a[0]);
  if (!saturated(b) && saturated(a)) b[2] = fadedHue(a, b[0]);
  return fromMsh(line(a, b, s));
}

}  // namespace

Rgb mixed(ColorSpace space, const Rgb& a, const Rgb& b, double s) {
  switch (space) {
    case ColorSpace::kRgb:
      return asRgb(line(asTriple(a), asTriple(b), s));
    case ColorSpace::kHsv:
      return mixedHsv(a, b, s, false);
    case ColorSpace::kHsvWrap:
      return mixedHsv(a, b, s, true);
    case ColorSpace::kLab:
      return fromLab(line(toLab(a), toLab(b), s));
    case ColorSpace::kDiverging:
      return mixedDiverging(a, b, s);
    case ColorSpace::kStep:
      break;
  }
  return b;
}

}  // namespace esvr
