#pragma once

#include <cstdint>

#include "cli/memory.h"

namespace esvr::samples {

/// A brick on its way into a file: 2124 bytes as SparseVolume and its search, and as much again for
/// OpenVDB's leaf and its compressed form.
inline constexpr std::uint64_t kBytesPerBrick = 4500;

/// Bricks that fit into three quarters of the machine's memory.
inline std::uint64_t bricksThatFit() { return cli::physicalMemory() / 4 * 3 / kBytesPerBrick; }

}  // namespace esvr::samples
