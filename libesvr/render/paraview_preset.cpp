// Reads and writes transfer functions as presets of ParaView: in its JSON format, and in the XML
// that it wrote before 2014.
#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "core/read_input.h"
#include "esvr/error.h"
#include "esvr/transfer_function.h"

namespace esvr {
namespace {

using boost::property_tree::ptree;
using nlohmann::json;

// Text. Programs on Windows write UTF-16, or UTF-8 with a byte order mark.

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
/// The text as UTF-8 without a byte order mark.
std::string asUtf8(std::string text) {
  if (text.starts_with("\xff\xfe")) return fromUtf16(text.substr(2), 0);
  if (text.starts_with("\xfe\xff")) return fromUtf16(text.substr(2), 1);
  if (text.starts_with("\xef\xbb\xbf")) return text.substr(3);
  // UTF-16 without a mark: the first character, which is '<', '[' or '{', has a byte of 0.
  if (text.size() > 1 && text[1] == 0 && text[0] != 0) return fromUtf16(text, 0);
  if (text.size() > 1 && text[0] == 0 && text[1] != 0) return fromUtf16(text, 1);
  return text;
}

// XML is converted to the JSON that ParaView writes today.

/// The end of the tag that begins at `at`: the place of its '>', which is not within quotes.
std::size_t endOfTag(const std::string& text, std::size_t at) {
  char quote = 0;
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != 0)
      quote = c == quote ? char(0) : quote;
    else if (c == '"' || c == '\'')
      quote = c;
    else if (c == '>')
      return at;
  }
  return text.size();
}

/// Refuses a text whose elements may be nested so deeply that the parser, which is recursive, has
/// no stack left.
void requireShallow(const std::string& text) {
  constexpr int kMostHolders = 1000;
  int holders = 0;
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; ++at) {
    const char next = at + 1 < text.size() ? text[at + 1] : '/';
    if (next == '/' || next == '?' || next == '!') continue;
    if (text[endOfTag(text, at) - 1] != '/' && ++holders > kMostHolders)
      throw BadInput("more than " + std::to_string(kMostHolders) + " elements hold others");
  }
}

ptree parsedXml(const std::string& text) {
  requireShallow(text);
  std::istringstream stream(text);
  ptree tree;
  try {
    read_xml(stream, tree);
  } catch (const boost::property_tree::xml_parser_error& error) {
    throw BadInput("not XML: " + error.message());
  }
  return tree;
}

double attribute(const ptree& node, const char* name) {
  return node.get<double>(std::string("<xmlattr>.") + name);
}

void appendColor(const ptree& node, json& to) {
  for (const char* channel : {"r", "g", "b"}) to.push_back(attribute(node, channel));
}

/// False for a map of colors only: its points have no opacity, or all have an opacity of 1.
bool hasOpacities(const ptree& map) {
  for (const auto& [tag, node] : map)
    if (tag == "Point" && node.get<double>("<xmlattr>.o", 1.0) != 1.0) return true;
  return false;
}

void appendPoint(const ptree& node, bool opacities, json& preset) {
  const double x = attribute(node, "x");
  preset["RGBPoints"].push_back(x);
  appendColor(node, preset["RGBPoints"]);
  if (!opacities) return;
  for (const double v : {x, node.get<double>("<xmlattr>.o", 1.0), 0.5, 0.0})
    preset["Points"].push_back(v);
}

json presetOf(const ptree& map) {
  json preset{{"Name", map.get<std::string>("<xmlattr>.name", "")}};
  const auto space = map.get<std::string>("<xmlattr>.space", "RGB");
  preset["ColorSpace"] = space == "Wrapped" ? "HSV" : space;
  preset["HSVWrap"] = space == "Wrapped";
  const bool opacities = hasOpacities(map);
  for (const auto& [tag, node] : map) {
    if (tag == "Point") appendPoint(node, opacities, preset);
    if (tag == "NaN") appendColor(node, preset["NanColor"]);
  }
  return preset;
}

/// Appends the color maps of a file, which may lie at the top level or inside <ColorMaps>.
void appendMaps(const ptree& tree, json& presets) {
  for (const auto& [tag, node] : tree) {
    if (tag == "ColorMap") presets.push_back(presetOf(node));
    if (tag == "ColorMaps") appendMaps(node, presets);
  }
}

/// Converts the color maps of a text. \param source  name of the text for errors
/// \throws BadInput  the text is not XML, an attribute is not a number, or more than 1000 elements
///                   hold others
json presetsOfXml(const std::string& text, const std::string& source) try {
  json presets = json::array();
  appendMaps(parsedXml(text), presets);
  return presets;
} catch (const BadInput& error) {
  throw BadInput(source + ": " + error.what());
} catch (const boost::property_tree::ptree_error& error) {
  throw BadInput(source + ": not a color map: " + error.what());
}

// JSON: an array of presets, or one preset.

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
  // VTK mixes colors of this space along straight lines in CIELAB, too; CIEDE2000 is its measure of
  // how far apart two colors are, by which it spaces them.
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
