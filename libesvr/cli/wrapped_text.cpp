#include "cli/wrapped_text.h"

#include <sstream>

namespace esvr::cli {
namespace {

std::string wrappedLine(const std::string& line, std::size_t width) {
  if (line.starts_with(' ')) return line;
  std::string out, word;
  std::size_t used = 0;
  for (std::istringstream words(line); words >> word; used += word.size()) {
    if (used > 0) {
      const bool fits = used + 1 + word.size() <= width;
      out += fits ? ' ' : '\n';
      used = fits ? used + 1 : 0;
    }
    out += word;
  }
  return out;
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t width) {
  std::istringstream lines(text);
  std::string out;
  for (std::string line; std::getline(lines, line);) out += wrappedLine(line, width) + '\n';
  if (!out.empty()) out.pop_back();
  return out;
}

}  // namespace esvr::cli
