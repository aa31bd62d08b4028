// The memory of voxels in the decoder-only build, which is always the heap.

#include <new>

#include "esvr/error.h"
#include "esvr/voxel_memory.h"

namespace esvr {

VoxelMemory::VoxelMemory(const Files&) {
  throw RuntimeFailure("this decoder keeps voxels in memory only, not in files");
}

bool VoxelMemory::isInFile(std::uint64_t) const { return false; }

void* VoxelMemory::allocate(std::size_t bytes) const { return ::operator new(bytes); }

void VoxelMemory::deallocate(void* array, std::size_t) const noexcept { ::operator delete(array); }

}  // namespace esvr
