#include "report/utf8.h"

#include <algorithm>
#include <cstdint>

namespace esvr::report {
namespace {

/// The number of bytes of the UTF-8 character at this position; 0 if there is none.
std::size_t characterAt(std::string_view text) {
  const auto byte = [&](std::size_t i) { return std::uint8_t(text[i]); };
  const std::size_t length = byte(0) < 0x80   ? 1
                             : byte(0) < 0xc2 ? 0
                             : byte(0) < 0xe0 ? 2
                             : byte(0) < 0xf0 ? 3
                             : byte(0) < 0xf5 ? 4
                                              : 0;
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  const bool overlong = (byte(0) == 0xe0 && byte(1) < 0xa0) || (byte(0) == 0xf0 && byte(1) < 0x90);
  const bool beyond = (byte(0) == 0xed && byte(1) >= 0xa0) || (byte(0) == 0xf4 && byte(1) >= 0x90);
  return length > 1 && (overlong || beyond) ? 0 : length;
}

bool isControl(char c) { return (std::uint8_t(c) < 0x20 && c != '\n') || c == 0x7f; }

}  // namespace

std::string validUtf8(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t length = characterAt(text);
    const bool valid = length > 0 && !isControl(text[0]);
    result += valid ? text.substr(0, length) : std::string_view("?");
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result;
}

}  // namespace esvr::report
