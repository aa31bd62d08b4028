#pragma once
/// The target of a fit: the volume less its background, scaled by a power of two, and the values
/// that a fit derives from it on any device.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "esvr/fit.h"
#include "esvr/volume.h"
#include "fit/adam.h"
#include "fit/seed.h"
#include "fit/tuning.h"

namespace esvr {

/// The units of a target and its range.
struct TargetScale {
  double scale = 1.0;                  ///< a power of two, so that scaling is exact
  double peak = 1.0;                   ///< scaled peak of the PSNR
  double lowest = 0.0, highest = 0.0;  ///< range of the scaled values and 0

  /// True if all values equal the background, of which the empty sum is exact.
  [[nodiscard]] bool empty() const { return lowest == 0.0 && highest == 0.0; }
};

struct FitTarget : TargetScale {
  std::vector<Coord> bricks;   ///< relative to the volume's origin, in bricks
  std::size_t seedBricks = 0;  ///< number of bricks, the first ones, in which seeds are placed
  std::vector<float> values;   ///< (value - background) * scale, at most 1 in magnitude
  /// Sums of ellipsoids that are not fitted, at the same voxels as `values`. They are added to the
  /// sum of the fitted ones. Empty: there are none.
  std::vector<float> constants;
  Box box;  ///< box of the PSNR, relative to the volume's origin
  double boxVoxels = 0.0;
  std::uint64_t activeVoxels = 0;
  bool saturates = false;                          ///< sums are clamped to this range
  bool narrowBand = false;                         ///< see FitOptions
  bool bothSigns = false;                          ///< see FitOptions
  const std::vector<BrickMask>* active = nullptr;  ///< active masks of the volume's bricks
  /// Largest scale, voxels, where it is less than Tuning::largestScale.
  double largestScale = std::numeric_limits<double>::infinity();
  std::optional<Box> within{};  ///< box of bricks outside which errors do not count; default: none
};

/// \param peak  peak of the PSNR in the units of the volume; default: peakOf(volume)
/// \throws BadInput  the volume has no active voxel
[[nodiscard]] TargetScale scaleOf(const SparseVolume& volume, std::optional<double> peak = {});

/// The given box or else the box of all active voxels, relative to the volume's origin.
[[nodiscard]] Box boxOf(const SparseVolume& volume, const std::optional<Box>& box);

/// Makes the target of a volume, which must outlive it.
/// \param peak  as for scaleOf
/// \throws BadInput  the volume has no active voxel
[[nodiscard]] FitTarget makeTarget(const SparseVolume& volume, const std::optional<Box>& box,
                                   std::optional<double> peak = {});

/// Makes the target of a volume, which must outlive it.
/// \param box  box of the PSNR, relative to the volume's origin
[[nodiscard]] FitTarget makeTarget(const SparseVolume& volume, const Box& box,
                                   const TargetScale& scale);

/// Bricks of a volume.
struct VolumePart {
  const SparseVolume& volume;
  std::span<const std::uint32_t> bricks;  ///< numbers, increasing
};

/// Makes the target of a part of a volume, with the units of the whole. The caller sets `active`.
/// \param box  box of the PSNR, relative to the volume's origin
[[nodiscard]] FitTarget makeTarget(const VolumePart& part, const Box& box,
                                   const TargetScale& scale);

/// The range of a volume's values, to which sums are clamped.
[[nodiscard]] ValueRange rangeOf(float background, const TargetScale& scale);

/// The signs that seeds may have.
[[nodiscard]] SignsAllowed signsOf(const FitTarget& target);

[[nodiscard]] EllipsoidLimits limitsOf(const FitTarget& target, const Tuning& tuning);

/// Half width of a seed's window: Tuning::seedWindow times the distance that the ellipsoids would
/// have if they were spread evenly over the active voxels.
[[nodiscard]] int seedWindow(const FitTarget& target, std::size_t ellipsoids, const Tuning& tuning);

/// The numbers that determine the memory of a fit.
struct FitSize {
  std::size_t bricks = 0;
  std::uint64_t activeVoxels = 0;
  bool narrowBand = false;  ///< see FitOptions
  bool constants = false;   ///< the target has constants
};
[[nodiscard]] FitSize sizeOf(const FitTarget& target);

}  // namespace esvr
