// Transfer functions: how colors and opacities are interpolated between their points, and the
// built-in ones.
#include "esvr/transfer_function.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <span>

#include "esvr/container.h"
#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {

// Colors are mixed in the color spaces that ParaView offers.

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

/// \param s  weight of b, from 0 to 1. In ColorSpace::kStep the result is always b
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

// Opacities are interpolated as VTK does.

/// The first point whose x is larger; the end if there is none.
template <class Point>
auto nextPoint(const std::vector<Point>& points, double x) {
  return std::upper_bound(points.begin(), points.end(), x,
                          [](double value, const Point& p) { return value < p.x; });
}
template <class Point>
double fraction(const Point& a, const Point& b, double x) {
  return (x - a.x) / (b.x - a.x);
}

/// Maps the position s between two points, from 0 to 1, so that `midpoint` is mapped to 1/2 (VTK's
/// midpoint of a node).
double bentAtMidpoint(double s, double midpoint) {
  if (s < midpoint) return 0.5 * s / midpoint;
  return midpoint < 1.0 ? 0.5 + 0.5 * (s - midpoint) / (1.0 - midpoint) : 1.0;
}

/// VTK's interpolation for a sharpness between 0 and 1: s is moved towards 0 or 1, and a Hermite
/// curve, whose tangents become flatter as the sharpness grows, gives the opacity.
double sharpened(double s, double sharpness, double y1, double y2) {
  const double power = 1.0 + 10.0 * sharpness;
  s = s < 0.5 ? 0.5 * std::pow(2.0 * s, power) : 1.0 - 0.5 * std::pow(2.0 * (1.0 - s), power);
  const double s2 = s * s, s3 = s2 * s, tangent = (1.0 - sharpness) * (y2 - y1);
  const double y = (2 * s3 - 3 * s2 + 1) * y1 + (3 * s2 - 2 * s3) * y2 +
                   (s3 - 2 * s2 + s) * tangent + (s3 - s2) * tangent;
  return std::clamp(y, std::min(y1, y2), std::max(y1, y2));
}

// VTK interpolates linearly below the first sharpness and makes a step above the second one.
constexpr double kStraight = 0.01, kStepped = 0.99;

double opacityBetween(const OpacityPoint& a, const OpacityPoint& b, double x) {
  const double s = bentAtMidpoint(fraction(a, b, x), a.midpoint);
  if (a.sharpness > kStepped) return s < 0.5 ? a.opacity : b.opacity;
  if (a.sharpness < kStraight) return (1 - s) * a.opacity + s * b.opacity;
  return sharpened(s, a.sharpness, a.opacity, b.opacity);
}

}  // namespace

Rgb colorAt(const ColorMap& map, double x) {
  if (std::isnan(x)) return map.nan;
  const auto next = nextPoint(map.points, x);
  if (next == map.points.begin()) return next->color;
  const auto last = std::prev(next);
  // At a point the result is the color of the point, also in ColorSpace::kStep.
  if (next == map.points.end() || x == last->x) return last->color;
  return mixed(map.space, last->color, next->color, fraction(*last, *next, x));
}

double opacityAt(const OpacityCurve& curve, double x) {
  if (std::isnan(x)) return 1.0;
  const auto next = nextPoint(curve, x);
  if (next == curve.begin()) return next->opacity;
  const auto last = std::prev(next);
  if (next == curve.end() || x == last->x) return last->opacity;
  return opacityBetween(*last, *next, x);
}

TransferFunction rescaled(TransferFunction function, ValueRange range) {
  const auto moveInto = [&](auto& points) {
    if (points.empty()) return;
    const double first = points.front().x, extent = points.back().x - first;
    const double target = double(range.max) - double(range.min);
    for (auto& p : points)
      p.x = double(range.min) + (extent > 0.0 ? (p.x - first) / extent * target : 0.0);
  };
  moveInto(function.colors.points);
  moveInto(function.opacity);
  return function;
}

// What a valid function is.

namespace {

template <class Point>
void checkOrder(const std::vector<Point>& points, const char* what) {
  if (points.empty()) throw UsageError(std::string("a transfer function without ") + what);
  const auto finite = [](const Point& p) { return std::isfinite(p.x); };
  const auto byX = [](const Point& a, const Point& b) { return a.x < b.x; };
  if (!std::all_of(points.begin(), points.end(), finite))
    throw UsageError(std::string("a transfer function with ") + what + " at no finite value");
  if (!std::is_sorted(points.begin(), points.end(), byX))
    throw UsageError(std::string("a transfer function with ") + what + " out of order");
}

bool withinUnit(double v) { return v >= 0.0 && v <= 1.0; }
bool withinUnit(const Rgb& c) { return withinUnit(c.r) && withinUnit(c.g) && withinUnit(c.b); }
bool withinUnit(const OpacityPoint& p) {
  return withinUnit(p.opacity) && withinUnit(p.midpoint) && withinUnit(p.sharpness);
}

}  // namespace

void checkTransferFunction(const TransferFunction& function) {
  checkOrder(function.colors.points, "colors");
  checkOrder(function.opacity, "opacities");
  const auto& colors = function.colors.points;
  if (!std::all_of(colors.begin(), colors.end(),
                   [](const ColorPoint& p) { return withinUnit(p.color); }) ||
      !withinUnit(function.colors.nan))
    throw UsageError("a transfer function with a color outside 0 to 1");
  if (!std::all_of(function.opacity.begin(), function.opacity.end(),
                   [](const OpacityPoint& p) { return withinUnit(p); }))
    throw UsageError("a transfer function with an opacity, midpoint or sharpness outside 0 to 1");
}

// Built-in functions.

namespace {

// The tables hold every fifth of a map's 256 colors as 0xRRGGBB. Linear interpolation gives the
// other colors to within 2.5/255 (tests/render/transfer_function_test.cpp checks some of them).
// Sources: viridis, magma, inferno and plasma are by S. van der Walt, N. Smith and E. Firing,
// bids.github.io/colormap (CC0). cividis (J. Nunez, C. Anderton and R. Renslow, PLOS ONE 13(7),
// 2018) and turbo (A. Mikhailov, "Turbo, an improved rainbow colormap", 2019) are computed by the
// polynomials that d3-scale-chromatic 3 publishes.
constexpr std::uint32_t kViridis[] = {
    0x440154, 0x46085c, 0x471063, 0x481769, 0x481d6f, 0x482475, 0x472a7a, 0x46307e, 0x453781,
    0x433d84, 0x414287, 0x3f4889, 0x3d4e8a, 0x3a538b, 0x38598c, 0x355e8d, 0x33638d, 0x31688e,
    0x2e6d8e, 0x2c718e, 0x2a768e, 0x297b8e, 0x27808e, 0x25848e, 0x23898e, 0x218e8d, 0x20928c,
    0x1f978b, 0x1e9c89, 0x1fa188, 0x21a585, 0x24aa83, 0x28ae80, 0x2eb37c, 0x35b779, 0x3dbc74,
    0x46c06f, 0x50c46a, 0x5ac864, 0x65cb5e, 0x70cf57, 0x7cd250, 0x89d548, 0x95d840, 0xa2da37,
    0xb0dd2f, 0xbddf26, 0xcae11f, 0xd8e219, 0xe5e419, 0xf1e51d, 0xfde725};
constexpr std::uint32_t kMagma[] = {
    0x000004, 0x02020b, 0x050416, 0x090720, 0x0e0b2b, 0x140e36, 0x1a1042, 0x21114e, 0x29115a,
    0x311165, 0x390f6e, 0x420f75, 0x4a1079, 0x52137c, 0x5a167e, 0x621980, 0x6a1c81, 0x721f81,
    0x792282, 0x812581, 0x892881, 0x912b81, 0x992d80, 0xa1307e, 0xaa337d, 0xb2357b, 0xba3878,
    0xc23b75, 0xca3e72, 0xd2426f, 0xd9466b, 0xe04c67, 0xe75263, 0xec5860, 0xf1605d, 0xf4695c,
    0xf7725c, 0xf97b5d, 0xfb8560, 0xfc8e64, 0xfd9869, 0xfea16e, 0xfeaa74, 0xfeb47b, 0xfebd82,
    0xfec68a, 0xfecf92, 0xfed89a, 0xfde2a3, 0xfdebac, 0xfcf4b6, 0xfcfdbf};
constexpr std::uint32_t kInferno[] = {
    0x000004, 0x02020c, 0x050417, 0x0a0722, 0x10092d, 0x160b39, 0x1e0c45, 0x260c51, 0x2f0a5b,
    0x380962, 0x400a67, 0x490b6a, 0x510e6c, 0x59106e, 0x61136e, 0x69166e, 0x71196e, 0x781c6d,
    0x801f6c, 0x88226a, 0x902568, 0x982766, 0xa02a63, 0xa82e5f, 0xb0315b, 0xb73557, 0xbf3952,
    0xc63d4d, 0xcc4248, 0xd34743, 0xd94d3d, 0xdf5337, 0xe45a31, 0xe9612b, 0xed6925, 0xf1711f,
    0xf47918, 0xf78212, 0xf98b0b, 0xfa9407, 0xfb9d07, 0xfca60c, 0xfcb014, 0xfbba1f, 0xfac42a,
    0xf8cd37, 0xf6d746, 0xf4e156, 0xf2ea69, 0xf2f27d, 0xf5f992, 0xfcffa4};
constexpr std::uint32_t kPlasma[] = {
    0x0d0887, 0x1b068d, 0x260591, 0x2f0596, 0x38049a, 0x41049d, 0x4903a0, 0x5102a3, 0x5901a5,
    0x6100a7, 0x6900a8, 0x7100a8, 0x7801a8, 0x8004a8, 0x8707a6, 0x8e0ca4, 0x9511a1, 0x9c179e,
    0xa21d9a, 0xa82296, 0xae2892, 0xb42e8d, 0xba3388, 0xbf3984, 0xc43e7f, 0xc9447a, 0xcd4a76,
    0xd24f71, 0xd6556d, 0xda5b69, 0xde6164, 0xe26660, 0xe66c5c, 0xe97257, 0xed7953, 0xf07f4f,
    0xf3854b, 0xf58c46, 0xf79342, 0xf99a3e, 0xfba139, 0xfca835, 0xfdaf31, 0xfeb72d, 0xfebe2a,
    0xfdc627, 0xfcce25, 0xfbd724, 0xf8df25, 0xf6e826, 0xf3f027, 0xf0f921};
constexpr std::uint32_t kCividis[] = {
    0x002051, 0x002459, 0x00275f, 0x002b64, 0x052e67, 0x09326a, 0x0f356c, 0x15396d, 0x1c3c6e,
    0x23406e, 0x29436e, 0x30476e, 0x374a6e, 0x3e4e6e, 0x44526d, 0x4b556d, 0x51596e, 0x575c6e,
    0x5c606e, 0x62646f, 0x67676f, 0x6c6b70, 0x706f71, 0x757272, 0x797673, 0x7d7a74, 0x817d75,
    0x858176, 0x898577, 0x8e8978, 0x928d78, 0x969178, 0x9b9578, 0x9f9978, 0xa49d78, 0xa9a177,
    0xaea575, 0xb4a974, 0xbaae72, 0xbfb26f, 0xc5b66c, 0xccbb69, 0xd2bf66, 0xd8c462, 0xdec85e,
    0xe4cd5a, 0xead256, 0xf0d652, 0xf4db4e, 0xf8e04b, 0xfbe548, 0xfdea45};
constexpr std::uint32_t kTurbo[] = {
    0x23171b, 0x362354, 0x422f83, 0x493ca8, 0x4b49c5, 0x4a56db, 0x4664ea, 0x4172f3, 0x3c80f8,
    0x368df9, 0x309bf6, 0x2ba7f0, 0x28b4e8, 0x26bfdf, 0x25cad3, 0x26d4c8, 0x29ddbb, 0x2ee5ae,
    0x35eca1, 0x3ef295, 0x48f788, 0x54fa7d, 0x61fd71, 0x6ffe67, 0x7efd5d, 0x8dfc55, 0x9cf94d,
    0xacf546, 0xbbf03f, 0xc9e93a, 0xd7e235, 0xe3d931, 0xeed02d, 0xf7c52a, 0xfeb927, 0xffad25,
    0xffa022, 0xff9320, 0xff851e, 0xff781c, 0xfc6a19, 0xf45c17, 0xea4f14, 0xdf4212, 0xd3360f,
    0xc62a0b, 0xb92108, 0xac1805, 0xa11202, 0x980e00, 0x920c00, 0x900c00};

template <auto& kTable>
ColorMap fromTable() {
  constexpr double kFull = 255.0;
  ColorMap map;
  for (std::size_t i = 0; i < std::size(kTable); ++i)
    map.points.push_back(
        {double(i) / double(std::size(kTable) - 1),
         {(kTable[i] >> 16) / kFull, (kTable[i] >> 8 & 0xff) / kFull, (kTable[i] & 0xff) / kFull}});
  return map;
}

ColorMap fromPoints(ColorSpace space, std::initializer_list<ColorPoint> points) {
  ColorMap map;
  map.space = space;
  map.points = points;
  return map;
}

// The two end colors are from K. Moreland, "Diverging color maps for scientific visualization",
// ISVC 2009.
ColorMap coolToWarm() {
  return fromPoints(ColorSpace::kDiverging,
                    {{0.0, {0.230, 0.299, 0.754}}, {1.0, {0.706, 0.016, 0.150}}});
}
ColorMap grayscale() {
  return fromPoints(ColorSpace::kRgb, {{0.0, {0.0, 0.0, 0.0}}, {1.0, {1.0, 1.0, 1.0}}});
}
ColorMap xRay() {
  return fromPoints(ColorSpace::kRgb, {{0.0, {1.0, 1.0, 1.0}}, {1.0, {0.0, 0.0, 0.0}}});
}
// The colors of ParaView's preset "Black-Body Radiation": black, red, yellow, white.
ColorMap blackBody() {
  return fromPoints(ColorSpace::kRgb, {{0.0, {0.0, 0.0, 0.0}},
                                       {0.4, {0.901961, 0.0, 0.0}},
                                       {0.8, {0.901961, 0.901961, 0.0}},
                                       {1.0, {1.0, 1.0, 1.0}}});
}

// Thin smoke is bright because light passes through it; dense smoke is dark gray.
ColorMap smoke() {
  return fromPoints(
      ColorSpace::kLab,
      {{0.0, {0.90, 0.90, 0.92}}, {0.3, {0.70, 0.70, 0.73}}, {1.0, {0.22, 0.22, 0.24}}});
}
// The map is for CT values that were scaled linearly from -1000 HU (0) to 2000 HU (1). Air is then
// at 0, fat at 0.30, muscle at 0.35, spongy bone from 0.43 and compact bone from 0.6.
ColorMap ctBone() {
  return fromPoints(ColorSpace::kRgb, {{0.0, {0.0, 0.0, 0.0}},
                                       {0.38, {0.55, 0.25, 0.15}},
                                       {0.45, {0.88, 0.60, 0.29}},
                                       {0.60, {1.0, 0.94, 0.82}},
                                       {1.0, {1.0, 1.0, 1.0}}});
}
ColorMap ctSoftTissue() {
  return fromPoints(ColorSpace::kRgb, {{0.0, {0.0, 0.0, 0.0}},
                                       {0.28, {0.95, 0.78, 0.62}},
                                       {0.33, {0.80, 0.36, 0.28}},
                                       {0.40, {0.62, 0.16, 0.14}},
                                       {0.55, {1.0, 0.94, 0.86}},
                                       {1.0, {1.0, 1.0, 1.0}}});
}

OpacityCurve linear() { return {{0.0, 0.0}, {1.0, 1.0}}; }
OpacityCurve inverse() { return {{0.0, 1.0}, {1.0, 0.0}}; }
OpacityCurve tent() { return {{0.0, 0.0}, {0.5, 1.0}, {1.0, 0.0}}; }
OpacityCurve smokeOpacity() { return {{0.0, 0.0}, {0.1, 0.08}, {0.5, 0.35}, {1.0, 0.9}}; }
OpacityCurve ctBoneOpacity() {
  return {{0.0, 0.0}, {0.40, 0.0}, {0.48, 0.3}, {0.65, 0.85}, {1.0, 0.95}};
}
OpacityCurve ctSoftTissueOpacity() {
  return {{0.0, 0.0},  {0.27, 0.0}, {0.30, 0.08}, {0.36, 0.25},
          {0.45, 0.3}, {0.65, 0.8}, {1.0, 0.9}};
}
OpacityCurve step() { return {{0.0, 0.0, 0.5, 1.0}, {1.0, 1.0}}; }

template <class Result>
struct BuiltIn {
  const char* name;
  Result (*make)();
};
constexpr BuiltIn<ColorMap> kColorMaps[] = {{"viridis", fromTable<kViridis>},
                                            {"inferno", fromTable<kInferno>},
                                            {"magma", fromTable<kMagma>},
                                            {"plasma", fromTable<kPlasma>},
                                            {"cividis", fromTable<kCividis>},
                                            {"turbo", fromTable<kTurbo>},
                                            {"cool-to-warm", coolToWarm},
                                            {"grayscale", grayscale},
                                            {"x-ray", xRay},
                                            {"black-body", blackBody},
                                            {"smoke", smoke},
                                            {"ct-bone", ctBone},
                                            {"ct-soft-tissue", ctSoftTissue}};
constexpr BuiltIn<OpacityCurve> kOpacities[] = {{"linear", linear},
                                                {"inverse", inverse},
                                                {"tent", tent},
                                                {"step", step},
                                                {"smoke", smokeOpacity},
                                                {"ct-bone", ctBoneOpacity},
                                                {"ct-soft-tissue", ctSoftTissueOpacity}};

template <class Result>
std::vector<std::string> namesOf(std::span<const BuiltIn<Result>> all) {
  std::vector<std::string> names;
  for (const auto& one : all) names.emplace_back(one.name);
  return names;
}

template <class Result>
Result named(std::span<const BuiltIn<Result>> all, const std::string& name, const char* what) {
  for (const auto& one : all)
    if (name == one.name) return one.make();
  std::string there;
  for (const auto& one : all) there += (there.empty() ? "" : ", ") + std::string(one.name);
  throw UsageError("no " + std::string(what) + " '" + name + "'; there are " + there +
                   didYouMean(name, namesOf(all)));
}

}  // namespace

std::vector<std::string> builtInColorMaps() { return namesOf<ColorMap>(kColorMaps); }
ColorMap builtInColorMap(const std::string& name) {
  return named<ColorMap>(kColorMaps, name, "color map");
}

TransferFunction levelSetSurface(double band) {
  constexpr Rgb kBody{0.90, 0.88, 0.84}, kLayer{0.15, 0.15, 0.20};
  constexpr double kLayerOpacity = 0.2, kLayerEnd = 0.5;  // of the band
  if (!(band > 0.0)) throw UsageError("the narrow band of a level set must be positive");
  return {{ColorSpace::kRgb, {{-band, kBody}, {0.0, kBody}, {0.0, kLayer}, {band, kLayer}}, {}},
          {{-band, 1.0}, {0.0, 1.0}, {0.0, kLayerOpacity}, {kLayerEnd * band, 0.0}, {band, 0.0}}};
}

namespace {

ValueRange rangeWithBackground(const LookBasis& grid) {
  ValueRange range = grid.range;
  range.expand(grid.background);
  return range;
}

/// The extinction per value and voxel with which a column of this depth lets half of the light
/// through.
double extinctionForHalf(double depth) { return std::log(2.0) / depth; }

}  // namespace

LookBasis lookBasis(const GridDescriptor& grid, const SparseVolume& volume) {
  LookBasis basis{.background = volume.background,
                  .isLevelSet = grid.gridClass == GridClass::kLevelSet};
  if (activeVoxelCount(volume) > 0) basis.range = activeRange(volume);
  if (grid.gridClass == GridClass::kFogVolume) basis.medianDepth = medianDepth(volume);
  return basis;
}

LookBasis lookBasis(const StoredGrid& grid, std::uint64_t maxBytes) {
  LookBasis basis{.range = {grid.valueMin, grid.valueMax},
                  .background = float(grid.descriptor.background),
                  .isLevelSet = grid.descriptor.gridClass == GridClass::kLevelSet};
  if (grid.descriptor.gridClass != GridClass::kFogVolume || grid.activeBox.empty()) return basis;
  basis.medianDepth =
      grid.voxels ? medianDepth(decodeGrid(grid, {.maxBytes = maxBytes, .keepsNonFinite = false}))
                  : medianDepth(grid.field, grid.activeBox, basis.range, grid.tone);
  return basis;
}

OpacityCurve usualOpacity(const LookBasis& grid) {
  constexpr double kFirst = 0.05, kLast = 8.0;  // extinctions; 8 leaves less than a thousandth
  const ValueRange range = rangeWithBackground(grid);
  OpacityCurve curve = rescaled({{}, builtInOpacity("linear")}, range).opacity;
  if (!grid.medianDepth || range.min < 0.0f || !(range.max > 0.0f)) return curve;
  const double k = extinctionForHalf(*grid.medianDepth);
  OpacityCurve raised{curve.front()};
  for (double extinction = kFirst; extinction < kLast; extinction *= 2.0) {
    const double value = extinction / k, opacity = -std::expm1(-extinction);
    if (!(value < double(range.max)) || opacity <= opacityAt(curve, value)) break;
    raised.push_back({value, opacity});
  }
  raised.push_back(curve.back());
  return raised;
}

TransferFunction usualLook(const LookBasis& grid, const std::string& colors) {
  if (grid.isLevelSet && grid.background > 0.0f) return levelSetSurface(double(grid.background));
  TransferFunction look = rescaled({builtInColorMap(colors), {}}, rangeWithBackground(grid));
  look.opacity = usualOpacity(grid);
  return look;
}

std::vector<std::string> builtInOpacities() { return namesOf<OpacityCurve>(kOpacities); }
OpacityCurve builtInOpacity(const std::string& name) {
  return named<OpacityCurve>(kOpacities, name, "opacity");
}

}  // namespace esvr
