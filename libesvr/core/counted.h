#pragma once
/// Numbers in messages. The decoder of the page uses them, and must not get the locales of the C++ library with a stream.

#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

namespace esvr {

/// A number of things with their noun, for example "1 voxel" and "2 voxels". \param thing  one of them
[[nodiscard]] inline std::string counted(std::uint64_t number, const std::string& thing) {
  return std::to_string(number) + " " + thing + (number == 1 ? "" : "s");
}

/// A number for a message, for example "1e-50".
[[nodiscard]] inline std::string shortText(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

/// Two numbers for a message that says that they differ: with as many more digits as it takes for their texts to do so.
/// \param format  of printf, with the number of digits before the value, for example "%.*f"
[[nodiscard]] inline std::pair<std::string, std::string> textsApart(double a, double b,
                                                                    const char* format,
                                                                    int digits) {
  constexpr int kAllDigits = 17;
  char first[400], second[400];  // fixed notation of any double
  do {
    std::snprintf(first, sizeof first, format, digits, a);
    std::snprintf(second, sizeof second, format, digits, b);
  } while (a != b && std::string(first) == second && digits++ < kAllDigits);
  return {first, second};
}

}  // namespace esvr
