// What the decoder-only build does without: voxels in files, and the bytes of carried grids, which need
// Blosc and mean nothing without OpenVDB.

#include <new>

#include "esvr/error.h"
#include "esvr/voxel_memory.h"
#include "format/carried_bytes.h"

namespace esvr {

VoxelMemory::VoxelMemory(const Files&) {
  throw RuntimeFailure("this decoder keeps voxels in memory only, not in files");
}

bool VoxelMemory::isInFile(std::uint64_t) const { return false; }

void* VoxelMemory::allocate(std::size_t bytes) const { return ::operator new(bytes); }

void VoxelMemory::deallocate(void* array, std::size_t) const noexcept { ::operator delete(array); }

namespace format {

VoxelArray<std::byte> readCarried(const ByteSource&, const SectionTable&, std::size_t,
                                  const VoxelMemory&) {
  throw RuntimeFailure("this decoder has no carried grids");
}

}  // namespace format

}  // namespace esvr
