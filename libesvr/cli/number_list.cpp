#include "cli/number_list.h"

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::cli {

std::vector<double> parseNumbers(const std::string& option, const std::string& text,
                                 std::size_t count) {
  const auto refuse = [&] {
    throw UsageError("--" + option + " must be " + std::to_string(count) +
                     " numbers with commas between, not '" + text + "'");
  };
  std::vector<double> numbers;
  std::string_view left = text;
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = parseLeadingNumber(left);
    if (!number) refuse();
    numbers.push_back(number->value);
    left = number->rest;
    if (i + 1 == count) break;
    if (!left.starts_with(',')) refuse();
    left.remove_prefix(1);
  }
  if (!left.empty()) refuse();
  return numbers;
}

}  // namespace esvr::cli
