#pragma once
/// Reads CSV files of esvr-compare.

#include <sstream>
#include <string>
#include <vector>

namespace esvr::test {

/// The fields of each line. Quoted fields have neither quotes nor line feeds in these tests.
inline std::vector<std::vector<std::string>> csvFields(const std::string& csv) {
  std::vector<std::vector<std::string>> lines;
  std::istringstream stream(csv);
  for (std::string line; std::getline(stream, line);) {
    auto& fields = lines.emplace_back(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == ',' && !quoted)
        fields.emplace_back();
      else if (c != '"')
        fields.back() += c;
    }
  }
  return lines;
}

}  // namespace esvr::test
