#pragma once
/// Files without names that are mapped into memory, and a thread that limits how much of them is in
/// the memory of the process.

#include <condition_variable>
#include <cstddef>
#include <map>
#include <mutex>
#include <thread>

#include "esvr/voxel_memory.h"

namespace esvr {

class VoxelFiles {
 public:
  explicit VoxelFiles(VoxelMemory::Files options) : options_(std::move(options)) {}
  ~VoxelFiles();
  VoxelFiles(const VoxelFiles&) = delete;
  VoxelFiles& operator=(const VoxelFiles&) = delete;

  [[nodiscard]] const VoxelMemory::Files& options() const { return options_; }

  /// Maps a new file, whose bytes are 0. Its place on the disk is reserved, so that writing to the
  /// memory cannot fail.
  /// \throws RuntimeFailure  the folder cannot be written, or its disk is full
  [[nodiscard]] void* map(std::size_t bytes);
  void unmap(void* array, std::size_t bytes) noexcept;

 private:
  void watch();
  void giveBack();

  VoxelMemory::Files options_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<void*, std::size_t> mapped_;  ///< sizes by addresses
  bool done_ = false;
  std::thread watcher_;  ///< runs from the first file on
};

}  // namespace esvr
