#include "cli/byte_size.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

struct Unit {
  const char* name;
  double bytes;
};
constexpr Unit kUnits[] = {{"", 1.0},   {"b", 1.0},      {"kb", 1e3},     {"mb", 1e6},
                           {"gb", 1e9}, {"kib", 0x1p10}, {"mib", 0x1p20}, {"gib", 0x1p30}};
constexpr double kMaxBytes = 1e15;

std::string lowered(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

}  // namespace

std::uint64_t parseByteSize(const std::string& option, const std::string& text) {
  const auto refuse = [&] {
    return UsageError("--" + option + " must be a size such as 50000, 50KB or 2.6MB, not '" + text +
                      "'");
  };
  const auto number = parseLeadingNumber(text);
  if (!number) throw refuse();
  const std::string name = lowered(std::string(number->rest));
  const auto unit = std::find_if(std::begin(kUnits), std::end(kUnits),
                                 [&](const Unit& u) { return name == u.name; });
  if (unit == std::end(kUnits)) throw refuse();
  const double bytes = std::floor(number->value * unit->bytes);
  if (!(bytes >= 1.0 && bytes <= kMaxBytes)) throw refuse();
  return std::uint64_t(bytes);
}

std::uint64_t parseDeviceMemory(const std::string& option, const std::string& text) {
  constexpr double kLeastBytes = 1e6;
  const auto number = parseLeadingNumber(text);
  const bool isGigabytes =
      number && number->rest.empty() && number->value > 0.0 && number->value < kLeastBytes;
  const std::uint64_t bytes = parseByteSize(option, isGigabytes ? text + "GB" : text);
  if (double(bytes) < kLeastBytes)
    throw UsageError("--" + option + " must be at least 1MB, not '" + text + "'");
  return bytes;
}

}  // namespace esvr::cli
