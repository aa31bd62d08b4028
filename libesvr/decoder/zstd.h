#pragma once
/// Decompresses Zstandard frames (RFC 8878), without dictionaries. The decoder-only build reads the
/// sections that Blosc has compressed with it.

#include <cstddef>
#include <span>
#include <string>

namespace esvr::decoder {

/// Decompresses one frame, whose content must fill `to` exactly. The frame's own checksum is not
/// verified, because sections of a file have checksums of their own.
/// \throws BadInput  the frame is damaged, has content of another size, or needs a dictionary; the
///                   text begins with `where`
void decompressZstd(std::span<const std::byte> frame, std::span<std::byte> to,
                    const std::string& where);

}  // namespace esvr::decoder
