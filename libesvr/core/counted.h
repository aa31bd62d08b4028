#pragma once
#include <cstdint>
#include <string>

namespace esvr {

/// A number of things with their noun, for example "1 voxel" and "2 voxels". \param thing  one of them
[[nodiscard]] inline std::string counted(std::uint64_t number, const std::string& thing) {
  return std::to_string(number) + " " + thing + (number == 1 ? "" : "s");
}

}  // namespace esvr
