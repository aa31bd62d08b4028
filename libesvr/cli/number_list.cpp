#include "cli/number_list.h"

#include <charconv>
#include <cmath>

#include "esvr/error.h"

namespace esvr::cli {

std::vector<double> parseNumbers(const std::string& option, const std::string& text,
                                 std::size_t count) {
  const auto refuse = [&] {
    throw UsageError("--" + option + " must be " + std::to_string(count) +
                     " numbers with commas between, not '" + text + "'");
  };
  std::vector<double> numbers(count);
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0 && (at == end || *at++ != ',')) refuse();
    const auto [next, error] = std::from_chars(at, end, numbers[i]);
    if (error != std::errc{} || !std::isfinite(numbers[i])) refuse();
    at = next;
  }
  if (at != end) refuse();
  return numbers;
}

}  // namespace esvr::cli
