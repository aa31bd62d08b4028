#pragma once
/// Reads sections piece by piece, so that their stored bytes need not be in memory.

#include "esvr/voxel_memory.h"
#include "format/section_table.h"

namespace esvr::format {

/// Checks the checksum of a section. \throws BadInput
void checkStored(const ByteSource& source, const SectionTable& table, std::size_t entry);

/// Reads the content of a section into an array of this memory. \throws BadInput
[[nodiscard]] VoxelArray<std::byte> readLarge(const ByteSource& source, const SectionTable& table,
                                              std::size_t entry, const VoxelMemory& memory);

}  // namespace esvr::format
