#pragma once
/// The error of a field between voxels, which is the error of its sum in pictures.

#include <optional>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"

namespace esvr {

struct BetweenOptions {
  std::optional<Box> box{};  ///< box of voxels whose surroundings count; default: the active box
  std::optional<ValueRange> range{};  ///< sums are clamped to this range, as a reader does
  /// As in FitOptions: only the volume's bricks count. Sums are clamped to the band instead of
  /// `range`.
  bool narrowBand = false;
  std::optional<double> peak{};  ///< peak of the PSNR; default: peakOf(volume)
};

/// PSNR, in dB, of the sum of a field against the trilinear interpolation of a volume. It is
/// measured at eight positions near each voxel, which are the same for all voxels and cover the
/// space between voxels evenly.
/// \throws BadInput  the volume has no active voxel
[[nodiscard]] double psnrBetween(const SparseVolume& volume, const Field& field,
                                 const BetweenOptions& options = {});

}  // namespace esvr
