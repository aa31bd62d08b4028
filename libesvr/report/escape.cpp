#include "report/escape.h"

#include "report/utf8.h"

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
  for (const char c : validUtf8(text)) append(c, result);
  return result;
}

}  // namespace esvr::report
