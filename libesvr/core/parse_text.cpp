#include "core/parse_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace esvr {
namespace {

/// Reads a number of type T at the beginning of a text and removes it from the text.
template <class T>
bool takeNumber(std::string_view& text, T& value) {
  const auto [next, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return false;
  text.remove_prefix(std::size_t(next - text.data()));
  return true;
}

}  // namespace

std::vector<std::string> splitText(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::optional<LeadingNumber> parseLeadingNumber(std::string_view text) {
  LeadingNumber number;
  if (!takeNumber(text, number.value) || !std::isfinite(number.value)) return std::nullopt;
  number.rest = text;
  return number;
}

std::optional<double> parseNumber(std::string_view text) {
  const auto number = parseLeadingNumber(text);
  return number && number->rest.empty() ? std::optional(number->value) : std::nullopt;
}

std::optional<std::int64_t> parseWhole(std::string_view text) {
  std::int64_t value = 0;
  return takeNumber(text, value) && text.empty() ? std::optional(value) : std::nullopt;
}

}  // namespace esvr
