#pragma once
/// The value of a voxel with a residual, computed by the writer and the reader in the same way.

#include <cstdint>

namespace esvr::format {

/// Adds the residual to the value of a voxel.
/// \param value  value of the sum, clamped to the grid's range if the grid says so
[[nodiscard]] inline float corrected(float value, std::int32_t code, double divisor) {
  return code == 0 ? value : float(double(value) + double(code) / divisor);
}

}  // namespace esvr::format
