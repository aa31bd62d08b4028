#include "render/view/transfer_json.h"

#include <array>

#include "render/view/json_members.h"

namespace esvr::view {
namespace {

constexpr std::size_t kMostPoints = 2048;

struct SpaceName {
  const char* name;
  ColorSpace space;
};
constexpr std::array kSpaces{SpaceName{"RGB", ColorSpace::kRgb},
                             SpaceName{"HSV", ColorSpace::kHsv},
                             SpaceName{"HSVWrap", ColorSpace::kHsvWrap},
                             SpaceName{"Lab", ColorSpace::kLab},
                             SpaceName{"Diverging", ColorSpace::kDiverging},
                             SpaceName{"Step", ColorSpace::kStep}};

ColorSpace spaceOf(const Members& members) {
  const auto name = members.text("space");
  if (!name) return ColorSpace::kRgb;
  for (const SpaceName& known : kSpaces)
    if (*name == known.name) return known.space;
  members.refuse("space", "must be RGB, HSV, HSVWrap, Lab, Diverging or Step");
}

const char* nameOf(ColorSpace space) {
  for (const SpaceName& known : kSpaces)
    if (space == known.space) return known.name;
  throw std::logic_error("jsonOf: no such color space");
}

/// The rows of an array of points.
const json& rowsOf(const Members& members, const char* name) {
  const json& rows = members.at(name);
  if (!rows.is_array() || rows.empty() || rows.size() > kMostPoints)
    members.refuse(name, "must be a list of 1 to " + std::to_string(kMostPoints) + " points");
  return rows;
}

}  // namespace

json jsonOf(const ColorMap& map) {
  json points = json::array();
  for (const ColorPoint& p : map.points) points.push_back({p.x, p.color.r, p.color.g, p.color.b});
  return {{"space", nameOf(map.space)}, {"points", points}};
}

json jsonOf(const OpacityCurve& curve) {
  json points = json::array();
  for (const OpacityPoint& p : curve) points.push_back({p.x, p.opacity, p.midpoint, p.sharpness});
  return points;
}

json jsonOf(const TransferFunction& function) {
  const json colors = jsonOf(function.colors);
  return {{"space", colors["space"]},
          {"colors", colors["points"]},
          {"opacity", jsonOf(function.opacity)}};
}

TransferFunction transferOf(const json& content) {
  const Members members(content, "transfer");
  members.requireKnown({"space", "colors", "opacity"});
  TransferFunction f;
  f.colors.space = spaceOf(members);
  for (const json& row : rowsOf(members, "colors")) {
    const auto v = numbersOf(row, 4, members.nameOf("colors"));
    f.colors.points.push_back({v[0], {v[1], v[2], v[3]}});
  }
  for (const json& row : rowsOf(members, "opacity")) {
    const auto v = numbersOf(row, 4, members.nameOf("opacity"));
    f.opacity.push_back({v[0], v[1], v[2], v[3]});
  }
  checkTransferFunction(f);
  return f;
}

}  // namespace esvr::view
