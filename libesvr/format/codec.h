#pragma once
/// Compresses and decompresses the content of a section (docs/format.md, "Codecs"). The bytes of carried
/// grids have a codec of their own (carried_bytes.h).

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "format/layout.h"

namespace esvr::format {

/// The content of a section as it is stored in the file.
struct Packed {
  Codec codec = Codec::kRaw;
  std::vector<std::byte> bytes;
  std::uint64_t rawBytes = 0;
};

/// Compresses content if that saves enough bytes. The same content gives the same bytes.
[[nodiscard]] Packed pack(std::vector<std::byte> raw);
/// The same for content that consists of f32.
[[nodiscard]] Packed packFloats(std::vector<std::byte> raw);

/// True if a codec can make `rawBytes` from `storedBytes`. A reader calls this before it allocates
/// memory.
[[nodiscard]] bool plausibleSizes(Codec codec, std::uint64_t storedBytes, std::uint64_t rawBytes);

/// Decompresses content. The sizes must be plausible. Content that is damaged becomes other content.
/// \throws BadInput  the codec is that of carried grids; the text begins with `where`
[[nodiscard]] std::vector<std::byte> unpack(Codec codec, std::vector<std::byte> stored,
                                            std::uint64_t rawBytes, const std::string& where);

}  // namespace esvr::format
