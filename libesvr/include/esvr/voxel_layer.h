#pragma once
/// A grid's voxels as integers, exact or within a bound: what a file holds where ellipsoids are not
/// near enough.

#include <cstdint>
#include <optional>
#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// The value that an integer n stands for.
enum class VoxelForm {
  kLattice = 0,  ///< float32(n / divisor), the division in float64
  kHalf = 1,     ///< half floats in their order: n >= 0 has the bits n, n < 0 the bits of -(-1 - n)
  kFloat = 2,    ///< float32 in the same way
  kPalette = 3   ///< the n-th of the values that there are
};

struct VoxelLayer {
  VoxelForm form = VoxelForm::kFloat;
  double divisor = 1.0;             ///< for kLattice
  std::vector<float> palette;       ///< for kPalette, in the order of kFloat
  Coord origin;                     ///< as SparseVolume's
  float background = 0.0f;          ///< exact
  std::vector<Coord> bricks;        ///< as SparseVolume's
  std::vector<std::int32_t> codes;  ///< kBrickVoxels a brick; at a vacant voxel the background's
  std::vector<BrickMask> active;
  std::vector<BrickMask> vacant;  ///< not active, and exactly the background

  friend bool operator==(const VoxelLayer&, const VoxelLayer&) = default;
};

/// Every voxel, its activity and the background bit for bit: as a palette where there are few
/// values (those of an 8-bit volume, whatever they were multiplied with), else as halves where all
/// are, else as floats.
[[nodiscard]] VoxelLayer exactLayer(const SparseVolume& volume);

/// The part of the activity of voxels that a layer keeps.
enum class Activity {
  kExact,   ///< all of it
  kByValue  ///< active are those that cannot be the background within the bound
};

/// Every voxel within `bound` of the volume's. Where rounding to float32 would break the bound,
/// exactLayer().
/// \throws UsageError  bound not positive and finite
[[nodiscard]] VoxelLayer boundedLayer(const SparseVolume& volume, double bound, Activity activity);

[[nodiscard]] SparseVolume volumeOf(const VoxelLayer& layer);

/// Largest |difference| of two volumes' voxels, over the bricks of both, active or not.
[[nodiscard]] double largestDifference(const SparseVolume& a, const SparseVolume& b);

/// That of a layer's voxels from its volume's.
[[nodiscard]] double largestError(const SparseVolume& volume, const VoxelLayer& layer);

}  // namespace esvr
