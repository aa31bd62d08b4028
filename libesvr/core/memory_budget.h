#pragma once
/// Limits on memory: sizes for people, and a limit on what a reader takes for the content of a file.

#include <cstdint>
#include <string>
#include <utility>

#include "esvr/device.h"
#include "esvr/volume.h"

namespace esvr {

/// A size for people, for example "512 MB" or "1.5 GB".
[[nodiscard]] std::string byteText(double bytes);

/// A limit on the memory that a reader takes for the content of a file.
class MemoryBudget {
 public:
  /// \param voxels  holds voxels
  explicit MemoryBudget(std::uint64_t maxBytes, VoxelMemory voxels = {})
      : max_(maxBytes), voxels_(std::move(voxels)) {}

  [[nodiscard]] const VoxelMemory& voxels() const { return voxels_; }

  /// Takes bytes from the budget, before they are allocated.
  /// \param what  start of the message
  /// \throws MemoryExceeded  the budget has fewer bytes
  void take(double bytes, const std::string& what) {
    taken_ += bytes;
    requireWithinMemory(taken_, max_, what);
  }

  /// Takes bytes for an array of voxels and what belongs to it. The array is in a file if it is large,
  /// and also if all arrays on the heap together would be: many grids that are small each may be too
  /// large together.
  /// \param onHeap  bytes that a file saves
  /// \param besides  bytes that are needed in any case
  /// \return where the array is
  /// \throws MemoryExceeded  as for take()
  [[nodiscard]] VoxelMemory takeVoxels(std::uint64_t arrayBytes, double onHeap, double besides,
                                       const std::string& what) {
    const bool areTooMany = voxels_.isInFile(arraysOnHeap_ + arrayBytes);
    VoxelMemory memory = areTooMany ? voxels_.forAllSizes() : voxels_;
    const bool isOnHeap = !memory.isInFile(arrayBytes);
    if (isOnHeap) arraysOnHeap_ += arrayBytes;
    take(besides + (isOnHeap ? onHeap : 0.0), what);
    return memory;
  }

 private:
  std::uint64_t max_;
  VoxelMemory voxels_;
  double taken_ = 0.0;
  std::uint64_t arraysOnHeap_ = 0;  ///< bytes of the arrays that takeVoxels() left on the heap
};

}  // namespace esvr
