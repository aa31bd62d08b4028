#pragma once
/// Limits on the memory that an input may ask for.

#include <cstdint>
#include <limits>
#include <string>

namespace esvr {

/// The limit that refuses nothing.
inline constexpr std::uint64_t kNoMemoryLimit = std::numeric_limits<std::uint64_t>::max();

/// \param what  begins the message: "grid 'density'"
/// \throws MemoryExceeded  neededBytes are more than maxBytes; names both
void requireWithinMemory(double neededBytes, std::uint64_t maxBytes, const std::string& what);

}  // namespace esvr
