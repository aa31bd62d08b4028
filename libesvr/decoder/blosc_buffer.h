#pragma once
/// Reads buffers of C-Blosc 1 that were compressed with Zstandard, as all of this project's files
/// are. The decoder-only build uses it in place of Blosc.

#include <cstddef>
#include <span>
#include <string>

namespace esvr::decoder {

/// The bytes of a buffer with this header, which has 16 bytes and is not checked.
[[nodiscard]] std::size_t bloscBufferBytes(std::span<const std::byte> header);

/// Decompresses a buffer to the beginning of `to`. \return the bytes of its content, above 0
/// \throws BadInput  the buffer is damaged or was compressed by something else than Zstandard; the
///                   text begins with `where`
std::size_t decompressBlosc(std::span<const std::byte> buffer, std::span<std::byte> to,
                            const std::string& where);

}  // namespace esvr::decoder
