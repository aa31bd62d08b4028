#include "cli/json_file.h"

#include <iostream>
#include <nlohmann/json.hpp>
#include <span>

#include "cli/bytes_file.h"
#include "esvr/grid_names.h"
#include "esvr/progress.h"

namespace esvr::cli {

std::string jsonText(const nlohmann::ordered_json& json, int indent) {
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  std::string text = json.dump(indent, ' ', false, kReplace);
  const bool isShown = shownText(text, LineEnds::kKeep) == text;
  return isShown ? text : json.dump(indent, ' ', true, kReplace);
}

void writeJson(const JsonFile& file, const nlohmann::ordered_json& json) {
  constexpr int kIndent = 2;
  const std::string text = jsonText(json, kIndent) + '\n';
  if (file.path == kStandardOutput) {
    std::cout << text;
    return;
  }
  const Completion completion;  // a report tells of an interrupted run, too
  writeBytes(file.path, std::as_bytes(std::span(text)), file.overwrite);
}

}  // namespace esvr::cli
