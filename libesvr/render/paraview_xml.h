#pragma once
/// Reads the XML color maps that ParaView wrote before 2014.

#include <nlohmann/json.hpp>
#include <string>

namespace esvr {

/// Converts the color maps of a text to presets in ParaView's JSON format.
/// \param source  name of the text for errors
/// \throws BadInput  the text is not XML, an attribute is not a number, or more than 1000 elements
///                   hold others
[[nodiscard]] nlohmann::json presetsOfXml(const std::string& text, const std::string& source);

}  // namespace esvr
