#include "render/view/look_names.h"

#include <algorithm>
#include <cmath>

namespace esvr::view {
namespace {

/// Rounding of colors and places in clients.
constexpr double kTolerance = 1e-9;

bool near(double a, double b, double scale = 1.0) { return std::abs(a - b) <= kTolerance * scale; }

bool sameColors(const ColorMap& a, const ColorMap& b, double extent) {
  const auto same = [&](const ColorPoint& p, const ColorPoint& q) {
    return near(p.x, q.x, extent) && near(p.color.r, q.color.r) && near(p.color.g, q.color.g) &&
           near(p.color.b, q.color.b);
  };
  return a.space == b.space &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(), same);
}

bool sameCurve(const OpacityCurve& a, const OpacityCurve& b, double extent) {
  const auto same = [&](const OpacityPoint& p, const OpacityPoint& q) {
    return near(p.x, q.x, extent) && near(p.opacity, q.opacity) && near(p.midpoint, q.midpoint) &&
           near(p.sharpness, q.sharpness);
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

}  // namespace

std::optional<LookNames> namesOf(const TransferFunction& f) {
  // Options give the range as float.
  const ValueRange range{float(f.opacity.front().x), float(f.opacity.back().x)};
  const double extent = std::max({std::abs(f.opacity.front().x), std::abs(f.opacity.back().x)});
  const auto over = [&](const ColorMap& map, const OpacityCurve& curve) {
    return rescaled({map, curve}, range);
  };
  for (const std::string& colors : builtInColorMaps())
    for (const std::string& opacity : builtInOpacities()) {
      const TransferFunction known = over(builtInColorMap(colors), builtInOpacity(opacity));
      if (sameColors(known.colors, f.colors, extent) && sameCurve(known.opacity, f.opacity, extent))
        return LookNames{colors, opacity, range};
    }
  return std::nullopt;
}

}  // namespace esvr::view
