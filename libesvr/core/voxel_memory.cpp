#include "esvr/voxel_memory.h"

#include <new>

#include "core/voxel_files.h"

namespace esvr {

VoxelMemory::VoxelMemory(const Files& files) : files_(std::make_shared<VoxelFiles>(files)) {}

bool VoxelMemory::isInFile(std::uint64_t bytes) const {
  return files_ && bytes > files_->options().maxHeapBytes;
}

void* VoxelMemory::allocate(std::size_t bytes) const {
  return isInFile(bytes) ? files_->map(bytes) : ::operator new(bytes);
}

void VoxelMemory::deallocate(void* array, std::size_t bytes) const noexcept {
  if (isInFile(bytes))
    files_->unmap(array, bytes);
  else
    ::operator delete(array);
}

}  // namespace esvr
