#include "cli/number_list.h"

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::cli {

std::vector<double> parseNumbers(const std::string& option, const std::string& text,
                                 std::size_t count) {
  const auto parts = splitText(text, ',');
  std::vector<double> numbers;
  for (const auto& part : parts)
    if (const auto number = parseNumber(part)) numbers.push_back(*number);
  if (parts.size() != count || numbers.size() != count)
    throw UsageError("--" + option + " must be " + std::to_string(count) +
                     " numbers with commas between, not '" + text + "'");
  return numbers;
}

}  // namespace esvr::cli
