#pragma once
/// The checksum of the file format: XXH64 with seed 0.

#include <cstddef>
#include <cstdint>
#include <span>

namespace esvr::format {

[[nodiscard]] std::uint64_t checksum(std::span<const std::byte> bytes);

}  // namespace esvr::format
