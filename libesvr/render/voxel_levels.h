#pragma once
/// Bricks of voxels of coarser levels of detail on the CPU.

#include <span>
#include <vector>

#include "esvr/sparse_volume.h"

namespace esvr {

/// Averages the voxels of a brick. The results are an eighth of a brick of the next coarser level.
/// \param corner  the eighth: the corner of the coarser brick (core/cell_corner.h) where it lies
/// \param coarser  output
void averageInto(std::span<const float, kBrickVoxels> voxels, int corner,
                 std::span<float, kBrickVoxels> coarser);

/// The next coarser level of a volume. It has no active voxels.
[[nodiscard]] SparseVolume coarserVolume(const SparseVolume& volume);

/// A volume and its coarser levels, which are made when they are first needed.
class VolumeLevels {
 public:
  /// \param volume  must outlive the object
  explicit VolumeLevels(const SparseVolume& volume) : volume_(volume) {}

  /// Makes the levels up to this one.
  void prepare(int last);
  /// \param level  0, or a level that was prepared
  [[nodiscard]] const SparseVolume& operator[](int level) const {
    return level == 0 ? volume_ : coarser_[std::size_t(level) - 1];
  }

 private:
  const SparseVolume& volume_;
  std::vector<SparseVolume> coarser_;
};

}  // namespace esvr
