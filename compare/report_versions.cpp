#include "compare/report_versions.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/version_json.h"
#include "cli/version_text.h"
#include "compare/program.h"
#include "esvr/baseline.h"

namespace esvr::compare {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::vector<std::string> versionLines() {
  std::vector<std::string> lines;
  std::string text = cli::versionText(kProgram);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (!zfpVersion().empty()) lines.push_back(zfpVersion());
  return lines;
}

nlohmann::ordered_json versionJson() {
  nlohmann::ordered_json versions = cli::versionJson();
  versions["zfp"] = nullptr;
  if (!zfpVersion().empty()) versions["zfp"] = zfpVersion();
  return versions;
}

}  // namespace esvr::compare
