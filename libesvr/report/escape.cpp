#include "report/escape.h"

#include "esvr/grid_names.h"

namespace esvr::report {
namespace {

void append(char c, std::string& to) {
  switch (c) {
    case '&':
      to += "&amp;";
      break;
    case '<':
      to += "&lt;";
      break;
    case '>':
      to += "&gt;";
      break;
    case '"':
      to += "&quot;";
      break;
    default:
      to += c;
  }
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : shownText(text, LineEnds::kKeep)) append(c, result);
  return result;
}

}  // namespace esvr::report
