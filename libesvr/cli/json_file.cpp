#include "cli/json_file.h"

#include <iostream>
#include <nlohmann/json.hpp>
#include <span>

#include "core/atomic_file.h"
#include "esvr/grid_names.h"

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
  AtomicFile output(file.path, file.overwrite);
  output.write(std::as_bytes(std::span(text)));
  output.commit();
}

}  // namespace esvr::cli
