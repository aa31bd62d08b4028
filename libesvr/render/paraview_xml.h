#pragma once
/// Reads the XML color maps that ParaView wrote before 2014.

#include <filesystem>
#include <nlohmann/json.hpp>

namespace esvr {

/// Converts the color maps of a file to presets in ParaView's JSON format.
/// \throws BadInput  the file is not XML, or an attribute is not a number
[[nodiscard]] nlohmann::json presetsOfXml(const std::filesystem::path& path);

}  // namespace esvr
