#pragma once
/// Sizes of launches, blocks and warps.

#include <cstddef>
#include <limits>
#include <string>

#include "core/cuda/check.h"

namespace esvr::cuda {

inline constexpr int kWarp = 32;
inline constexpr int kBlock = 256;  ///< usual number of threads in a block

/// \return the number of blocks that cover `items`, with `perBlock` in each
/// \throws DeviceError  a launch cannot have so many blocks
inline unsigned blocksFor(std::size_t items, std::size_t perBlock) {
  const std::size_t blocks = items / perBlock + (items % perBlock != 0);
  if (blocks > std::size_t(std::numeric_limits<int>::max()))
    throw DeviceError("CUDA: a launch of " + std::to_string(blocks) + " blocks is too large");
  return unsigned(blocks);
}

}  // namespace esvr::cuda
