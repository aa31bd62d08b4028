#pragma once
/// ParaView's color maps of before 2014.

#include <filesystem>
#include <nlohmann/json.hpp>

namespace esvr {

/// The maps of a file as presets of the JSON form. \throws BadInput  not XML, not numbers
[[nodiscard]] nlohmann::json presetsOfXml(const std::filesystem::path& path);

}  // namespace esvr
