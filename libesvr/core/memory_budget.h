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

 private:
  std::uint64_t max_;
  VoxelMemory voxels_;
  double taken_ = 0.0;
};

}  // namespace esvr
