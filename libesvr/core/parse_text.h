#pragma once
/// Parses lists and numbers that people write, in the same way in every locale.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace esvr {

/// The parts of a text between separators. A text without a separator is one part.
[[nodiscard]] std::vector<std::string> splitText(const std::string& text, char separator);

/// A finite number that is the whole text, for example "3", "-0.5" or "2e-4"; else nothing.
[[nodiscard]] std::optional<double> parseNumber(std::string_view text);

/// A whole number that is the whole text; else nothing.
[[nodiscard]] std::optional<std::int64_t> parseWhole(std::string_view text);

/// A number and the text after it: "50KB" is 50 and "KB". Nothing if the text begins with no
/// number.
struct LeadingNumber {
  double value = 0.0;
  std::string_view rest;
};
[[nodiscard]] std::optional<LeadingNumber> parseLeadingNumber(std::string_view text);

}  // namespace esvr
