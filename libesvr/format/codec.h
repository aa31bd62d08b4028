#pragma once
/// Compression of a section's content.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/layout.h"

namespace esvr::format {

/// A section's content as it lies in the file.
struct Packed {
  Codec codec = Codec::kRaw;
  std::vector<std::byte> bytes;
  std::uint64_t rawBytes = 0;
};

/// Compresses where that pays. The same content gives the same bytes.
/// \param typeSize  bytes of the content's numbers, which the shuffle takes apart
[[nodiscard]] Packed pack(std::vector<std::byte> raw, std::size_t typeSize);

/// Whether a codec can make `rawBytes` from `storedBytes` at all: asked before anything is
/// allocated.
[[nodiscard]] bool plausibleSizes(Codec codec, std::uint64_t storedBytes, std::uint64_t rawBytes);

/// The content. Sizes must be plausible. \throws BadInput  damaged; begins with `where`
[[nodiscard]] std::vector<std::byte> unpack(Codec codec, std::vector<std::byte> stored,
                                            std::uint64_t rawBytes, const std::string& where);

}  // namespace esvr::format
