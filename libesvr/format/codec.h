#pragma once
/// Compresses and decompresses the content of a section.

#include <cstddef>
#include <cstdint>
#include <span>
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
/// \param typeSize  size in bytes of the numbers that the content consists of, for the shuffle
[[nodiscard]] Packed pack(std::vector<std::byte> raw, std::size_t typeSize);

/// True if a codec can make `rawBytes` from `storedBytes`. A reader calls this before it allocates
/// memory.
[[nodiscard]] bool plausibleSizes(Codec codec, std::uint64_t storedBytes, std::uint64_t rawBytes);

/// Decompresses content. The sizes must be plausible.
/// \throws BadInput  the content is damaged; the text begins with `where`
[[nodiscard]] std::vector<std::byte> unpack(Codec codec, std::vector<std::byte> stored,
                                            std::uint64_t rawBytes, const std::string& where);

}  // namespace esvr::format
