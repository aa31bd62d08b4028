#include "render/paraview_xml.h"

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>

#include "esvr/error.h"

namespace esvr {
namespace {

using boost::property_tree::ptree;
using nlohmann::json;

ptree parsedXml(const std::filesystem::path& path) {
  ptree tree;
  try {
    read_xml(path.string(), tree);
  } catch (const boost::property_tree::xml_parser_error& error) {
    throw BadInput(path.string() + ": not XML: " + error.message());
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

json presetsOfXml(const std::filesystem::path& path) {
  json presets = json::array();
  try {
    appendMaps(parsedXml(path), presets);
  } catch (const boost::property_tree::ptree_error& error) {
    throw BadInput(path.string() + ": not a color map: " + error.what());
  }
  return presets;
}

}  // namespace esvr
