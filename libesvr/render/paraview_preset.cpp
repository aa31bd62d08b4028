#include <algorithm>
#include <cstdint>
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

void appendUtf8(std::uint32_t code, std::string& to) {
  const auto put = [&](std::uint32_t byte) { to += char(static_cast<unsigned char>(byte)); };
  const auto putTail = [&](int shift) { put(0x80u | (code >> shift & 0x3fu)); };
  if (code < 0x80u) return put(code);
  if (code < 0x800u) {
    put(0xc0u | code >> 6);
  } else if (code < 0x10000u) {
    put(0xe0u | code >> 12), putTail(6);
  } else {
    put(0xf0u | code >> 18), putTail(12), putTail(6);
  }
  putTail(0);
}

/// UTF-16 as UTF-8. \param low  place of the low byte in each unit of two bytes
std::string fromUtf16(const std::string& text, std::size_t low) {
  std::string utf8;
  const auto unit = [&](std::size_t at) {
    return std::uint32_t(static_cast<unsigned char>(text[at + low])) |
           std::uint32_t(static_cast<unsigned char>(text[at + 1 - low])) << 8;
  };
  for (std::size_t at = 0; at + 1 < text.size(); at += 2) {
    std::uint32_t code = unit(at);
    const bool isPair = code >= 0xd800u && code < 0xdc00u && at + 3 < text.size();
    if (isPair)
      at += 2, code = 0x10000u + ((code - 0xd800u) << 10) + ((unit(at) - 0xdc00u) & 0x3ffu);
    appendUtf8(code, utf8);
  }
  return utf8;
}

/// The text as UTF-8 without a byte order mark. Programs on Windows write UTF-16, or the mark.
std::string asUtf8(std::string text) {
  if (text.starts_with("\xff\xfe")) return fromUtf16(text.substr(2), 0);
  if (text.starts_with("\xfe\xff")) return fromUtf16(text.substr(2), 1);
  if (text.starts_with("\xef\xbb\xbf")) return text.substr(3);
  // UTF-16 without a mark: the first character, which is '<', '[' or '{', has a byte of 0.
  if (text.size() > 1 && text[1] == 0 && text[0] != 0) return fromUtf16(text, 0);
  if (text.size() > 1 && text[0] == 0 && text[1] != 0) return fromUtf16(text, 1);
  return text;
}

bool isXml(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && text[first] == '<';
}

json parsed(const std::string& original, const std::string& source) {
  constexpr bool kThrows = false, kSkipsComments = true;
  const std::string text = asUtf8(original);
  if (isXml(text)) return presetsOfXml(text, source);
  json content = json::parse(text, nullptr, kThrows, kSkipsComments);
  if (content.is_discarded()) throw BadInput(source + ": not JSON");
  return content.is_array() ? content : json::array({std::move(content)});
}

std::string nameOf(const json& preset) {
  const auto name = preset.find("Name");
  return name != preset.end() && name->is_string() ? name->get<std::string>() : "";
}

/// False for members that are missing or null, which mean the same.
bool has(const json& preset, const char* key) {
  const auto found = preset.find(key);
  return found != preset.end() && !found->is_null();
}

/// A preset of colors for categories (IndexedColors) may have an empty list of points.
bool hasColors(const json& preset) {
  return preset.is_object() && has(preset, "RGBPoints") && !preset["RGBPoints"].empty();
}

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

/// Clamps a channel or an opacity that is outside 0 to 1 by rounding only.
double withinRounding(double v) {
  constexpr double kRounding = 1e-6;  // of float32 and of decimal texts with six digits
  if (v < 0.0 && v >= -kRounding) return 0.0;
  return v > 1.0 && v <= 1.0 + kRounding ? 1.0 : v;
}

Rgb colorOf(double r, double g, double b) {
  return {withinRounding(r), withinRounding(g), withinRounding(b)};
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
    points.push_back({v[i], colorOf(v[i + 1], v[i + 2], v[i + 3])});
  sortByX(points);
  return points;
}

OpacityCurve opacityPoints(const json& preset) {
  const auto v = numbers(preset, "Points", 4);
  OpacityCurve points;
  for (std::size_t i = 0; i < v.size(); i += 4)
    points.push_back(
        {v[i], withinRounding(v[i + 1]), withinRounding(v[i + 2]), withinRounding(v[i + 3])});
  sortByX(points);
  return points;
}

bool flag(const json& preset, const char* key) {
  const auto value = preset.find(key);
  if (value == preset.end()) return false;
  return value->is_boolean() ? value->get<bool>() : *value == 1;
}

ColorSpace spaceOf(const json& preset) {
  const auto found = preset.find("ColorSpace");
  const std::string given =
      found != preset.end() && found->is_string() ? found->get<std::string>() : "RGB";
  std::string name = given;
  for (char& c : name)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  if (name == "rgb") return ColorSpace::kRgb;
  if (name == "hsv") return flag(preset, "HSVWrap") ? ColorSpace::kHsvWrap : ColorSpace::kHsv;
  // VTK mixes colors of this space along straight lines in CIELAB, too; CIEDE2000 is its measure of how
  // far apart two colors are, by which it spaces them.
  if (name == "lab" || name == "cielab" || name == "lab/ciede2000") return ColorSpace::kLab;
  if (name == "diverging") return ColorSpace::kDiverging;
  if (name == "step") return ColorSpace::kStep;
  throw BadInput("ColorSpace \"" + given +
                 "\" is none of RGB, HSV, Lab, Lab/CIEDE2000, Diverging, Step");
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
  if (has(preset, "NanColor")) {
    const auto c = numbers(preset, "NanColor", 3);
    f.colors.nan = colorOf(c[0], c[1], c[2]);
  }
  f.opacity = has(preset, "Points") && !preset["Points"].empty() ? opacityPoints(preset)
                                                                 : linearOver(f.colors.points);
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
