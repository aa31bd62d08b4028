#pragma once
/// The target of a fit: the volume less its background, scaled by a power of two.

#include <cstdint>
#include <optional>
#include <vector>

#include "esvr/sparse_volume.h"

namespace esvr {

struct FitTarget {
  std::vector<Coord> bricks;  ///< see SparseVolume::bricks
  std::vector<float> values;  ///< (value - background) * scale, at most 1 in magnitude
  double scale = 1.0;         ///< a power of two, so that scaling is exact
  Box box;                    ///< box of the PSNR, relative to the volume's origin
  double boxVoxels = 0.0;
  std::uint64_t activeVoxels = 0;
  double peak = 1.0;                   ///< scaled peakOf(volume)
  double lowest = 0.0, highest = 0.0;  ///< range of `values` and 0
  bool saturates = false;              ///< sums are clamped to this range
  bool narrowBand = false;             ///< see FitOptions
  bool bothSigns = false;              ///< see FitOptions
  /// Share of the iterations that compare at the voxels; the others compare between them.
  double voxelShare = 1.0;
  const std::vector<BrickMask>* active = nullptr;  ///< active masks of the volume's bricks
  std::optional<Box> within{};  ///< box of bricks outside which errors do not count; default: none

  /// \return whether some iterations compare between voxels
  [[nodiscard]] bool betweenVoxels() const { return voxelShare < 1.0; }
};

/// Makes the target of a volume, which must outlive it.
/// \throws BadInput  the volume has no active voxel
[[nodiscard]] FitTarget makeTarget(const SparseVolume& volume, const std::optional<Box>& box);

}  // namespace esvr
