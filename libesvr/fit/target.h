#pragma once
/// What a fit aims at: the volume less its background, scaled by a power of two.

#include <cstdint>
#include <optional>
#include <vector>

#include "esvr/sparse_volume.h"

namespace esvr {

struct FitTarget {
  std::vector<Coord> bricks;  ///< as SparseVolume::bricks
  std::vector<float> values;  ///< (value - background) * scale, at most 1 in magnitude
  double scale = 1.0;         ///< a power of two: scaling by it is exact
  Box box;                    ///< of 'PSNR over the box', relative to the volume's origin
  double boxVoxels = 0.0;
  std::uint64_t activeVoxels = 0;
  double peak = 1.0;                               ///< peakOf(volume), scaled
  double lowest = 0.0, highest = 0.0;              ///< range of `values`, zero included
  bool narrowBand = false;                         ///< FitOptions::narrowBand
  const std::vector<BrickMask>* active = nullptr;  ///< of the volume the target was made from
  std::optional<Box> within{};  ///< bricks: what lies elsewhere counts for nothing; default: all
};

/// The volume must outlive the target. \throws BadInput  no active voxel
[[nodiscard]] FitTarget makeTarget(const SparseVolume& volume, const std::optional<Box>& box);

}  // namespace esvr
