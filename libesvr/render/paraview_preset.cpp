#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "core/read_input.h"
#include "esvr/error.h"
#include "esvr/transfer_function.h"
#include "render/paraview_xml.h"

namespace esvr {
namespace {

using nlohmann::json;

bool isXml(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && text[first] == '<';
}

json parsed(const std::string& text, const std::string& source) {
  if (isXml(text)) return presetsOfXml(text, source);
  json content = json::parse(text, nullptr, false);
  if (content.is_discarded()) throw BadInput(source + ": not JSON");
  return content.is_array() ? content : json::array({std::move(content)});
}

std::string nameOf(const json& preset) {
  const auto name = preset.find("Name");
  return name != preset.end() && name->is_string() ? name->get<std::string>() : "";
}

bool hasColors(const json& preset) { return preset.is_object() && preset.contains("RGBPoints"); }

std::string listed(const json& presets) {
  std::string names;
  for (const json& preset : presets)
    if (hasColors(preset)) names += (names.empty() ? "" : ", ") + ("\"" + nameOf(preset) + "\"");
  return names.empty() ? "none" : names;
}

const json& chosen(const json& presets, const std::string& name, const std::string& file) {
  for (const json& preset : presets)
    if (hasColors(preset) && (name.empty() || nameOf(preset) == name)) return preset;
  throw BadInput(file + ": no preset" + (name.empty() ? "" : " \"" + name + "\"") +
                 " with RGBPoints; there are " + listed(presets));
}

/// The numbers of an array whose length must be a multiple of `row`.
std::vector<double> numbers(const json& preset, const char* key, std::size_t row) {
  const json& array = preset.at(key);
  const bool fits =
      array.is_array() && !array.empty() && array.size() % row == 0 &&
      std::all_of(array.begin(), array.end(), [](const json& v) { return v.is_number(); });
  if (!fits)
    throw BadInput(std::string(key) + " is no list of numbers, " + std::to_string(row) +
                   " a point");
  return array.get<std::vector<double>>();
}

template <class Point>
void sortByX(std::vector<Point>& points) {
  std::stable_sort(points.begin(), points.end(),
                   [](const Point& a, const Point& b) { return a.x < b.x; });
}

std::vector<ColorPoint> colorPoints(const json& preset) {
  const auto v = numbers(preset, "RGBPoints", 4);
  std::vector<ColorPoint> points;
  for (std::size_t i = 0; i < v.size(); i += 4)
    points.push_back({v[i], {v[i + 1], v[i + 2], v[i + 3]}});
  sortByX(points);
  return points;
}

OpacityCurve opacityPoints(const json& preset) {
  const auto v = numbers(preset, "Points", 4);
  OpacityCurve points;
  for (std::size_t i = 0; i < v.size(); i += 4)
    points.push_back({v[i], v[i + 1], v[i + 2], v[i + 3]});
  sortByX(points);
  return points;
}

bool flag(const json& preset, const char* key) {
  const auto value = preset.find(key);
  if (value == preset.end()) return false;
  return value->is_boolean() ? value->get<bool>() : *value == 1;
}

ColorSpace spaceOf(const json& preset) {
  const std::string name = preset.contains("ColorSpace") && preset["ColorSpace"].is_string()
                               ? preset["ColorSpace"].get<std::string>()
                               : "RGB";
  if (name == "RGB") return ColorSpace::kRgb;
  if (name == "HSV") return flag(preset, "HSVWrap") ? ColorSpace::kHsvWrap : ColorSpace::kHsv;
  if (name == "Lab" || name == "CIELAB") return ColorSpace::kLab;
  if (name == "Diverging") return ColorSpace::kDiverging;
  if (name == "Step") return ColorSpace::kStep;
  throw BadInput("ColorSpace \"" + name + "\" is none of RGB, HSV, Lab, Diverging, Step");
}

OpacityCurve linearOver(const std::vector<ColorPoint>& colors) {
  OpacityCurve curve = builtInOpacity("linear");
  curve.front().x = colors.front().x;
  curve.back().x = colors.back().x;
  return curve;
}

TransferFunction functionOf(const json& preset) {
  TransferFunction f;
  f.colors.space = spaceOf(preset);
  f.colors.points = colorPoints(preset);
  if (preset.contains("NanColor")) {
    const auto c = numbers(preset, "NanColor", 3);
    f.colors.nan = {c[0], c[1], c[2]};
  }
  f.opacity = preset.contains("Points") ? opacityPoints(preset) : linearOver(f.colors.points);
  checkTransferFunction(f);
  return f;
}

/// The function of a preset, with its name in the text of errors.
TransferFunction namedFunction(const json& preset, const std::string& source) try {
  return functionOf(preset);
} catch (const Error& error) {
  throw BadInput(source + ": preset \"" + nameOf(preset) + "\": " + error.what());
}

const char* nameOf(ColorSpace space) {
  switch (space) {
    case ColorSpace::kRgb:
      return "RGB";
    case ColorSpace::kHsv:
    case ColorSpace::kHsvWrap:
      return "HSV";
    case ColorSpace::kLab:
      return "Lab";
    case ColorSpace::kDiverging:
      return "Diverging";
    case ColorSpace::kStep:
      return "Step";
  }
  throw std::logic_error("writeParaViewPreset: no such space");
}

}  // namespace

std::string paraViewPreset(const TransferFunction& function, const std::string& name) {
  checkTransferFunction(function);
  const ColorMap& map = function.colors;
  nlohmann::ordered_json preset{{"Name", name}, {"ColorSpace", nameOf(map.space)}};
  if (map.space == ColorSpace::kHsvWrap) preset["HSVWrap"] = true;
  preset["NanColor"] = {map.nan.r, map.nan.g, map.nan.b};
  for (const ColorPoint& p : map.points)
    for (const double v : {p.x, p.color.r, p.color.g, p.color.b}) preset["RGBPoints"].push_back(v);
  for (const OpacityPoint& p : function.opacity)
    for (const double v : {p.x, p.opacity, p.midpoint, p.sharpness}) preset["Points"].push_back(v);
  return nlohmann::ordered_json::array({preset}).dump(2) + "\n";
}

TransferFunction readParaViewPreset(const std::filesystem::path& path, const std::string& name) {
  const json presets = parsed(readText(path), path.string());
  return namedFunction(chosen(presets, name, path.string()), path.string());
}

std::vector<NamedTransferFunction> paraViewPresets(const std::string& text,
                                                   const std::string& source) {
  const json presets = parsed(text, source);
  std::vector<NamedTransferFunction> functions;
  for (const json& preset : presets)
    if (hasColors(preset)) functions.push_back({nameOf(preset), namedFunction(preset, source)});
  if (functions.empty()) throw BadInput(source + ": no preset with RGBPoints");
  return functions;
}

}  // namespace esvr
