#pragma once
/// Corrects the checksums of an .esvr file with any content.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace esvr::fuzz {

/// A copy with the correct size, version, magic number and checksums, as far as header and table
/// lie in the file. Without it a fuzzer would never get past the first checksum.
[[nodiscard]] std::vector<std::byte> repaired(std::span<const std::byte> bytes);

}  // namespace esvr::fuzz
