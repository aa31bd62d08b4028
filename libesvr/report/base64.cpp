#include "report/base64.h"

#include <algorithm>
#include <cstdint>

namespace esvr::report {

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  constexpr std::size_t kGroup = 3, kDigitsPerGroup = 4, kDigitBits = 6;
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); at += kGroup) {
    const std::size_t have = std::min(kGroup, bytes.size() - at);
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < kGroup; ++i)
      bits = bits << 8 | (i < have ? std::uint8_t(bytes[at + i]) : 0u);
    for (std::size_t i = 0; i < kDigitsPerGroup; ++i) {
      const std::uint32_t digit = bits >> (kDigitBits * (kDigitsPerGroup - 1 - i)) & 63u;
      text += i <= have ? kDigits[digit] : '=';
    }
  }
  return text;
}

}  // namespace esvr::report
