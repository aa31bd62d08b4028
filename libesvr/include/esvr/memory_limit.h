#pragma once
/// Limits on the memory that an input may need.

#include <cstdint>
#include <limits>
#include <string>

namespace esvr {

/// The value of a limit that allows any amount of memory.
inline constexpr std::uint64_t kNoMemoryLimit = std::numeric_limits<std::uint64_t>::max();

/// The limit of interfaces whose callers name none: half of the memory of the machine, so that a small
/// file that asks for more is refused before the machine swaps.
[[nodiscard]] std::uint64_t usualMemoryLimit();

/// Checks an amount of memory against a limit.
/// \param what  subject of the message, for example "grid 'density'"
/// \throws MemoryExceeded  neededBytes is more than maxBytes; the text gives both numbers
void requireWithinMemory(double neededBytes, std::uint64_t maxBytes, const std::string& what);

}  // namespace esvr
