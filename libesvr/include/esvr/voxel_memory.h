#pragma once
/// Memory for arrays of voxels. Usually it is the heap. Arrays that are larger than a limit are in
/// files that the system maps into memory, so that a volume may be larger than the memory.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace esvr {

class VoxelFiles;

/// A choice between the heap and files, by size. Copies share their files, and any thread may use
/// them. The files have no names; the system removes them when the last array ends, or the process.
class VoxelMemory {
 public:
  VoxelMemory() = default;  ///< always the heap

  struct Files {
    std::filesystem::path folder;    ///< on a disk; a folder in memory would save none
    std::uint64_t maxHeapBytes = 0;  ///< larger arrays are in files
    /// Limit on the part of all files that is in the memory of the process. A thread looks several
    /// times a second and gives back what exceeds the limit, so that it may be exceeded in between.
    std::uint64_t maxResidentBytes = 0;
  };
  explicit VoxelMemory(const Files& files);

  /// \return whether an array of this size is in a file
  [[nodiscard]] bool isInFile(std::uint64_t bytes) const;

  /// Checks that the disk of the files has this many bytes free. The heap is not checked.
  /// \param what  subject of the message, for example "grid 'density'"
  /// \throws MemoryExceeded  it has fewer; the text names the folder and gives both numbers
  void requireRoom(double bytes, const std::string& what) const;

  /// \throws RuntimeFailure  the folder cannot be written, or its disk is full
  /// \throws std::bad_alloc  the heap is full
  [[nodiscard]] void* allocate(std::size_t bytes) const;
  void deallocate(void* array, std::size_t bytes) const noexcept;

  friend bool operator==(const VoxelMemory&, const VoxelMemory&) = default;

 private:
  std::shared_ptr<VoxelFiles> files_;  ///< null: always the heap
};

/// The allocator of arrays of voxels. A copy of an array is in the same kind of memory.
template <class T>
class VoxelAllocator {
 public:
  using value_type = T;
  using propagate_on_container_copy_assignment = std::true_type;
  using propagate_on_container_move_assignment = std::true_type;
  using propagate_on_container_swap = std::true_type;

  VoxelAllocator() = default;
  VoxelAllocator(VoxelMemory memory) : memory_(std::move(memory)) {}  // NOLINT: converts
  template <class U>
  VoxelAllocator(const VoxelAllocator<U>& other) : memory_(other.memory()) {}

  [[nodiscard]] const VoxelMemory& memory() const { return memory_; }
  [[nodiscard]] T* allocate(std::size_t count) {
    return static_cast<T*>(memory_.allocate(count * sizeof(T)));
  }
  void deallocate(T* array, std::size_t count) noexcept {
    memory_.deallocate(array, count * sizeof(T));
  }
  friend bool operator==(const VoxelAllocator&, const VoxelAllocator&) = default;

 private:
  VoxelMemory memory_;
};

template <class T>
using VoxelArray = std::vector<T, VoxelAllocator<T>>;

}  // namespace esvr
