#pragma once
/// --report.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace esvr::cli {

inline constexpr const char* kStandardOutput = "-";

struct JsonFile {
  std::string path;  ///< kStandardOutput for stdout
  bool overwrite = false;
};

/// Writes it whole or not at all; text that is not UTF-8 (file and grid names may be anything) has
/// its stray bytes replaced. \throws RuntimeFailure  not writable
void writeJson(const JsonFile& file, const nlohmann::ordered_json& json);

}  // namespace esvr::cli
