#include "esvr/voxel_memory.h"

#include <filesystem>
#include <new>
#include <system_error>

#include "core/byte_text.h"
#include "core/voxel_files.h"
#include "esvr/error.h"

namespace esvr {

VoxelMemory::VoxelMemory(const Files& files) : files_(std::make_shared<VoxelFiles>(files)) {}

bool VoxelMemory::isInFile(std::uint64_t bytes) const {
  return files_ && bytes > files_->options().maxHeapBytes;
}

void VoxelMemory::requireRoom(double bytes, const std::string& what) const {
  if (!files_) return;
  std::error_code unknown;
  const auto space = std::filesystem::space(files_->options().folder, unknown);
  if (unknown || bytes <= double(space.available)) return;
  throw MemoryExceeded(what + " asks for up to " + byteText(bytes) + " of files in " +
                       files_->options().folder.string() + ", which has " +
                       byteText(double(space.available)) + " free");
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
