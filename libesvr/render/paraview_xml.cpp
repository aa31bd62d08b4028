#include "render/paraview_xml.h"

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cstddef>
#include <sstream>

#include "esvr/error.h"

namespace esvr {
namespace {

using boost::property_tree::ptree;
using nlohmann::json;

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

/// Refuses a text whose elements may be nested so deeply that the parser, which is recursive, has no
/// stack left.
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

}  // namespace

json presetsOfXml(const std::string& text, const std::string& source) try {
  json presets = json::array();
  appendMaps(parsedXml(text), presets);
  return presets;
} catch (const BadInput& error) {
  throw BadInput(source + ": " + error.what());
} catch (const boost::property_tree::ptree_error& error) {
  throw BadInput(source + ": not a color map: " + error.what());
}

}  // namespace esvr
