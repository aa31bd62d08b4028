#pragma once
/// Checks numbers that kernels count in 32 bits.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "esvr/error.h"

namespace esvr::cuda {

/// Largest count with which a loop that advances by the threads of a block ends before it wraps.
inline constexpr std::size_t kMaxCount32 = std::numeric_limits<std::uint32_t>::max() - 1024;

/// \param what  plural for the message, for example "pairs"
/// \throws DeviceError  the count is too large for kernels
[[nodiscard]] inline std::uint32_t count32(std::size_t count, const char* what) {
  if (count > kMaxCount32)
    throw DeviceError("CUDA: " + std::to_string(count) + " " + what +
                      " are more than kernels can number");
  return std::uint32_t(count);
}

}  // namespace esvr::cuda
