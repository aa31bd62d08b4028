#include "esvr/transfer_function.h"

#include <algorithm>
#include <cmath>

#include "esvr/error.h"
#include "render/color_spaces.h"

namespace esvr {
namespace {

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

template <class Point>
void moveInto(std::vector<Point>& points, ValueRange range) {
  if (points.empty()) return;
  const double first = points.front().x, extent = points.back().x - first;
  const double target = double(range.max) - double(range.min);
  for (Point& p : points)
    p.x = double(range.min) + (extent > 0.0 ? (p.x - first) / extent * target : 0.0);
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
  moveInto(function.colors.points, range);
  moveInto(function.opacity, range);
  return function;
}

}  // namespace esvr
