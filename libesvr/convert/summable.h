#pragma once
/// Decides whether values can be sums of ellipsoids in float32.

#include <optional>

#include "esvr/volume.h"

namespace esvr::convert {

/// Intensities may be larger than the values, and the partial sums of many overlapping ellipsoids
/// larger still. Values up to this difference from the background leave a factor of 256 to the
/// largest number of float32.
inline constexpr float kLargestSummable = 0x1p120f;

/// A voxel whose value differs too much from the background, or nothing.
[[nodiscard]] std::optional<Coord> tooLargeForSums(const SparseVolume& volume);

}  // namespace esvr::convert
