#pragma once
/// A voxel of a sum with a residual: computed alike by who writes and by who reads.

#include <cstdint>

namespace esvr::format {

/// \param value  of the sum, kept within the grid's range where that is asked for
[[nodiscard]] inline float corrected(float value, std::int32_t code, double divisor) {
  return code == 0 ? value : float(double(value) + double(code) / divisor);
}

}  // namespace esvr::format
