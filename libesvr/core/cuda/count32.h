#pragma once
/// Numbers of things that kernels count in 32 bits.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "esvr/error.h"

namespace esvr::cuda {

/// A loop that goes on by a block's threads ends before it would wrap around.
inline constexpr std::size_t kMaxCount32 = std::numeric_limits<std::uint32_t>::max() - 1024;

/// \param what  names the things in the plural, for the message
/// \throws DeviceError  there are more than kernels can number
[[nodiscard]] inline std::uint32_t count32(std::size_t count, const char* what) {
  if (count > kMaxCount32)
    throw DeviceError("CUDA: " + std::to_string(count) + " " + what +
                      " are more than kernels can number");
  return std::uint32_t(count);
}

}  // namespace esvr::cuda
