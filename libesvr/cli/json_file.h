#pragma once
/// The option --report.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace esvr::cli {

inline constexpr const char* kStandardOutput = "-";

struct JsonFile {
  std::string path;  ///< kStandardOutput: stdout
  bool overwrite = false;
};

/// Writes the whole file or nothing. Bytes of names that are not UTF-8 are replaced.
/// \throws RuntimeFailure  the file is not writable
void writeJson(const JsonFile& file, const nlohmann::ordered_json& json);

}  // namespace esvr::cli
