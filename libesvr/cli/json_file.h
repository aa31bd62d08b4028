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

/// JSON that may be printed to a terminal: if a text in it could control the terminal (shownText in
/// esvr/grid_names.h), all characters beyond ASCII are escaped. Bytes that are not UTF-8 are replaced.
/// \param indent  columns of a level; -1: everything is in one line
[[nodiscard]] std::string jsonText(const nlohmann::ordered_json& json, int indent);

/// Writes the whole file or nothing, as jsonText. Bytes of names that are not UTF-8 are replaced.
/// \throws RuntimeFailure  the file is not writable
void writeJson(const JsonFile& file, const nlohmann::ordered_json& json);

}  // namespace esvr::cli
