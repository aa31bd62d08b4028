#pragma once
/// Compresses the bytes of records, lists of positions and the like: small numbers and texts, much of which
/// repeats what was before (docs/format.md, "Coded bytes").

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace esvr::codec {

[[nodiscard]] std::vector<std::byte> encodeBytes(std::span<const std::byte> bytes);

/// Decodes what encodeBytes() made of `count` bytes. Zeros after it are ignored. Damaged bytes are decoded,
/// too, to others.
[[nodiscard]] std::vector<std::byte> decodeBytes(std::span<const std::byte> coded,
                                                 std::uint64_t count);

}  // namespace esvr::codec
