#include "report/units.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace esvr::report {

std::string plainText(double value) {
  std::array<char, 400> text;  // fixed notation of any double
  std::snprintf(text.data(), text.size(), "%.3g", value);
  const double rounded = std::strtod(text.data(), nullptr);
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), rounded, std::chars_format::fixed);
  return {text.data(), end.ptr};
}

std::string bytesText(double bytes) {
  constexpr std::array kUnits{" B", " KB", " MB", " GB", " TB"};
  constexpr double kNext = 999.5;  // is rounded to 1000
  std::size_t unit = 0;
  for (; bytes >= kNext && unit + 1 < kUnits.size(); ++unit) bytes /= 1000.0;
  return plainText(bytes) + kUnits[unit];
}

}  // namespace esvr::report
