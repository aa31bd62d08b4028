#pragma once
/// Takes text apart: lists and numbers as people write them, the same in every locale.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace esvr {

/// The parts of a text between separators; one part, the text itself, where there is none.
[[nodiscard]] std::vector<std::string> splitText(const std::string& text, char separator);

/// A finite number that takes the whole text: "3", "-0.5", "2e-4". Nothing for anything else.
[[nodiscard]] std::optional<double> parseNumber(std::string_view text);

/// A whole number that takes the whole text. Nothing for anything else.
[[nodiscard]] std::optional<std::int64_t> parseWhole(std::string_view text);

/// A number, and the text behind it: "50KB" is 50 and "KB". Nothing where no number begins the text.
struct LeadingNumber {
  double value = 0.0;
  std::string_view rest;
};
[[nodiscard]] std::optional<LeadingNumber> parseLeadingNumber(std::string_view text);

}  // namespace esvr
