#pragma once
/// Numbers in messages. The decoder of the page uses them, and must not get the locales of the C++ library with a stream.

#include <cstdint>
#include <cstdio>
#include <string>

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

}  // namespace esvr
