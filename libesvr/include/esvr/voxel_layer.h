#pragma once
/// A grid's voxels as integer codes, exact or within a bound. A file holds such a layer if voxels
/// were chosen instead of ellipsoids (convert.h), or as a residual.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "esvr/coord.h"
#include "esvr/simplified_mask.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// The meaning of an integer code n.
enum class VoxelForm {
  kQuantised = 0,  ///< quantised: the value float32(n / divisor), divided in float64
  /// Half floats in increasing order. n >= 0 is the value with the bits n; n < 0 is the negated
  /// value with the bits -1 - n.
  kHalf = 1,
  kFloat = 2,   ///< float32 in the same way
  kPalette = 3  ///< palette entry n
};

struct VoxelLayer {
  VoxelForm form = VoxelForm::kFloat;
  double divisor = 1.0;            ///< divisor of kQuantised
  std::vector<float> palette;      ///< values of kPalette, in the order of kFloat
  Coord origin;                    ///< see SparseVolume
  float background = 0.0f;         ///< exact background
  std::vector<Coord> bricks;       ///< see SparseVolume
  VoxelArray<std::int32_t> codes;  ///< kBrickVoxels per brick; vacant voxels have the background's
  std::vector<BrickMask> active;
  std::vector<BrickMask> vacant;  ///< inactive voxels that are exactly the background

  friend bool operator==(const VoxelLayer&, const VoxelLayer&) = default;
};

/// Makes a layer that holds every voxel, the active mask and the background bit for bit. The form
/// is kPalette if there are few distinct values (as in a scaled 8-bit volume), else kHalf if half
/// floats can hold all values, else kFloat.
[[nodiscard]] VoxelLayer exactLayer(const SparseVolume& volume);

/// How a stored grid says which voxels are active. No voxel outside the active bounding box of the
/// source ever becomes active.
enum class Activity {
  /// By value if the overlap with the mask of the source then suffices (MaskOverlap,
  /// simplified_mask.h). Otherwise a simplified mask is stored, with which it does.
  kAuto,
  kNoMask,  ///< as kAuto, but no mask is stored
  kExact,   ///< the exact active mask is stored
  kByValue  ///< a voxel is active if its value differs from the background by more than the bound
};

/// Whether rounding keeps the signs of values. The surface of a level set is where they change.
enum class RoundedSigns {
  kMayChange,  ///< values are rounded to the nearest code
  /// A negative value never becomes 0, and no other value becomes negative. The quantisation steps
  /// are half as wide as without it, so that the values nearest to 0 keep the bound, too.
  kKept
};

/// The numbers that a reader of a grid gets (ValueType, grid_descriptor.h).
enum class DecodedValues {
  kFloats,
  kHalfs  ///< active voxels are rounded by roundToHalfs() after everything else
};

/// Rounds active voxels to the nearest half floats, as decodeGrid() does for a grid whose source was
/// saved as half. Values beyond 65504 become 65504 with their sign, and no negative value becomes 0.
void roundToHalfs(SparseVolume& volume);

/// Makes a layer whose voxels are within `bound` of the volume's. If float32 is too coarse for the
/// bound, the layer is exactLayer(). With a simplified mask, voxels of the source that differ from
/// the background by more than the bound are active too.
/// \param simplified  the volume's simplified masks for kAuto, if they are kept; null: one is made
/// \param decoded     with kHalfs, the rounded voxels are within the bound, too. The volume's own
///                    active voxels must be halfs.
/// \throws UsageError  the bound is not positive and finite
[[nodiscard]] VoxelLayer boundedLayer(const SparseVolume& volume, double bound, Activity activity,
                                      RoundedSigns signs = RoundedSigns::kMayChange,
                                      const SimplifiedMasks* simplified = nullptr,
                                      DecodedValues decoded = DecodedValues::kFloats);

/// What thriftyLayer() weighs. All errors are in squared steps of the quantisation lattice.
struct ThriftOptions {
  /// Squared error that may be added to save a bit. By the theory of fine quantisation it is
  /// ln(2) / 6 = 0.1155 (6.02 dB for each bit); with much larger values, the predictions of later
  /// voxels become worse.
  double bitPrice = 0.0;
  /// The layer of the previous frame of a sequence. The bits are those of a frame that is predicted
  /// from it (frame_coding.h). Null: those of a volume of its own.
  const VoxelLayer* previous = nullptr;
  /// Share of the errors of the previous frame that the voxels keep, from 0 to 1. The errors are
  /// estimated from the difference between neighbours. It is ignored without `previous`.
  double steadiness = 0.0;
  /// With kKept, no code gets another sign (negative or not) than the voxel has in the volume.
  RoundedSigns signs = RoundedSigns::kMayChange;
  /// Bytes of the codes above which the work stops. It is ignored with `previous`.
  std::uint64_t mostBytes = std::numeric_limits<std::uint64_t>::max();
};

struct ThriftyLayer {
  VoxelLayer layer;
  /// Set if the codes take more than ThriftOptions::mostBytes: the bytes of all codes, extrapolated
  /// from those that were chosen. The layer is incomplete then and should not be used.
  std::optional<std::uint64_t> tooMany{};
};

/// Makes a layer smaller by rate-distortion optimised quantisation. A voxel gets a code at most
/// two steps away that takes fewer bits, if its squared error grows by less than the saved bits
/// times the price of a bit. The error of a voxel is then at most 2.5 steps of the quantisation
/// lattice, and errors are correlated with the coder's predictions. Vacant voxels remain vacant.
/// \param layer  a layer that boundedLayer made from `volume`; other forms than kQuantised are
///               returned unchanged
[[nodiscard]] ThriftyLayer thriftyLayer(const SparseVolume& volume, VoxelLayer layer,
                                        const ThriftOptions& options);

[[nodiscard]] SparseVolume volumeOf(const VoxelLayer& layer);

/// True if all values that volumeOf() would return are finite, besides the background. Nothing is
/// allocated. The codes must have values.
[[nodiscard]] bool allFinite(const VoxelLayer& layer);

/// Largest absolute difference of two volumes' voxels over the bricks of both, active or not.
[[nodiscard]] double largestDifference(const SparseVolume& a, const SparseVolume& b);

/// Largest absolute difference of a layer's voxels from the volume's.
[[nodiscard]] double largestError(const SparseVolume& volume, const VoxelLayer& layer);

}  // namespace esvr
