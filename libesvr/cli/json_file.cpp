#include "cli/json_file.h"

#include <iostream>
#include <nlohmann/json.hpp>
#include <span>

#include "core/atomic_file.h"
#include "esvr/progress.h"

namespace esvr::cli {
namespace {

std::string textOf(const nlohmann::ordered_json& json) {
  constexpr int kIndent = 2;
  constexpr bool kAsciiOnly = false;
  return json.dump(kIndent, ' ', kAsciiOnly, nlohmann::json::error_handler_t::replace) + '\n';
}

}  // namespace

void writeJson(const JsonFile& file, const nlohmann::ordered_json& json) {
  const std::string text = textOf(json);
  if (file.path == kStandardOutput) {
    std::cout << text;
    return;
  }
  const Completion completion;  // a report tells of an interrupted run, too
  AtomicFile output(file.path, file.overwrite);
  output.write(std::as_bytes(std::span(text)));
  output.commit();
}

}  // namespace esvr::cli
