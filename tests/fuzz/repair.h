#pragma once
/// Makes the checksums of an .esvr file right, whatever is in it.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace esvr::fuzz {

/// A copy whose size, version, magic and checksums match, as far as header and table lie in the
/// file: without it a fuzzer would never get past the first checksum.
[[nodiscard]] std::vector<std::byte> repaired(std::span<const std::byte> bytes);

}  // namespace esvr::fuzz
