#pragma once
/// How much memory the machine has and the process takes.

#include <cstdint>

namespace esvr::cli {

/// Bytes of physical memory.
[[nodiscard]] std::uint64_t physicalMemory();

/// Bytes of the most memory that the process has held at once.
[[nodiscard]] std::uint64_t peakMemory();

}  // namespace esvr::cli
