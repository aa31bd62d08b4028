#pragma once

#include <cstdint>

#include "cli/memory.h"

namespace esvr::samples {

/// Memory of a brick until it is written: 2124 bytes in the SparseVolume and the search for it, and
/// the same amount for OpenVDB's leaf and its compressed form.
inline constexpr std::uint64_t kBytesPerBrick = 4500;

/// The number of bricks that fit into three quarters of the machine's memory.
inline std::uint64_t bricksThatFit() { return cli::physicalMemory() / 4 * 3 / kBytesPerBrick; }

}  // namespace esvr::samples
