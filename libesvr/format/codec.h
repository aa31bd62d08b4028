#pragma once
/// Compresses and decompresses the content of a section.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esvr/voxel_memory.h"
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

/// Content that may be too large for the heap, as it is stored in the file.
struct PackedLarge {
  Codec codec = Codec::kRaw;
  VoxelArray<std::byte> bytes;
};

/// Compresses bytes if that saves enough of them. The result is in the same memory.
[[nodiscard]] PackedLarge packLarge(const VoxelArray<std::byte>& raw);

/// True if a codec can make `rawBytes` from `storedBytes`. A reader calls this before it allocates
/// memory.
[[nodiscard]] bool plausibleSizes(Codec codec, std::uint64_t storedBytes, std::uint64_t rawBytes);

/// Decompresses content. The sizes must be plausible.
/// \throws BadInput  the content is damaged; the text begins with `where`
[[nodiscard]] std::vector<std::byte> unpack(Codec codec, std::vector<std::byte> stored,
                                            std::uint64_t rawBytes, const std::string& where);

// The parts of a section that Blosc has compressed. They throw BadInput, with a text that begins
// with `where`, if the bytes are damaged.

inline constexpr std::uint64_t kBloscHeaderBytes = 16;

/// Bytes of content in the buffers of a section, which end with zeros.
[[nodiscard]] std::uint64_t paddedForBlosc(std::uint64_t rawBytes);

/// The bytes of a buffer with this header. The header is not checked.
[[nodiscard]] std::uint64_t storedBytesOf(std::span<const std::byte> header);

/// Decompresses a buffer to the beginning of `to`. \return the bytes of its content, above 0
std::size_t decompressBuffer(std::span<const std::byte> buffer, std::span<std::byte> to,
                             const std::string& where);

/// Refuses content whose bytes after the first `rawBytes` are not zero.
void refuseContentAfter(std::uint64_t rawBytes, std::span<const std::byte> content,
                        const std::string& where);

}  // namespace esvr::format
