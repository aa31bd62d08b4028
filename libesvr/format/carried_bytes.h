#pragma once
/// The bytes of carried grids, as sections. They may be too large for the heap, and Blosc compresses them,
/// because a compressor of records would take minutes for gigabytes. Nothing else in a file needs Blosc.

#include "esvr/volume.h"
#include "format/section_table.h"

namespace esvr::format {

/// Bytes as they are stored in the file.
struct PackedCarried {
  Codec codec = Codec::kRaw;
  VoxelArray<std::byte> bytes;
};

/// Compresses bytes if that saves enough of them. The result is in the same memory.
[[nodiscard]] PackedCarried packCarried(const VoxelArray<std::byte>& raw);

/// Reads the content of a section into an array of this memory, piece by piece, so that its stored bytes
/// need not be in memory. The decoder-only build, which has no Blosc, throws RuntimeFailure instead.
/// \throws BadInput
[[nodiscard]] VoxelArray<std::byte> readCarried(const ByteSource& source, const SectionTable& table,
                                                std::size_t entry, const VoxelMemory& memory);

}  // namespace esvr::format
