#pragma once
/// A mask of active voxels that takes fewer bytes than that of a volume and is nearly the same.

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "esvr/sparse_volume.h"

namespace esvr {

/// The overlap (intersection over union) of the active voxels of a source and of its stored grid is
/// above this, unless the grid was told to find active voxels by their values (Activity).
inline constexpr double kMinOverlap = 0.95;

/// Voxels that are active in both masks, and in one of them at least.
struct MaskOverlap {
  std::uint64_t both = 0, either = 0;

  /// Intersection over union; 1 if no voxel is active.
  [[nodiscard]] double iou() const { return either > 0 ? double(both) / double(either) : 1.0; }
  [[nodiscard]] bool suffices() const { return iou() > kMinOverlap; }
};
/// \param a, b  masks of the same bricks
[[nodiscard]] MaskOverlap overlapOf(std::span<const BrickMask> a, std::span<const BrickMask> b);

/// Simplifies the active mask of a volume until hardly more of the overlap may be given up. A voxel
/// changes if the bits that this saves, by the contexts of the voxel coder, are worth more than the
/// voxel; blocks of up to 8^3 voxels are changed together as well. The more a voxel differs from
/// the background, the more it is worth. The active box stays the same, and no voxel outside the
/// volume's bricks becomes active. The result is the same for any number of threads.
/// \param expected  masks of the volume's bricks from which a decoder will predict them, such as those
///                  of the previous frame of a sequence, or nothing
/// \param error  error of the stored values at active voxels (root mean square), above 0. A voxel
///               that differs from the background by this much is worth twice as much as one that
///               does not differ, and one that differs by more than four times as much keeps its
///               state
/// \return masks of the volume's bricks, whose overlap with the volume's suffices()
[[nodiscard]] std::vector<BrickMask> simplifiedMask(const SparseVolume& volume, double error,
                                                    std::span<const BrickMask> expected = {});

/// The simplified masks of a volume, which are made when they are first needed. Any number of
/// threads can ask at the same time.
class SimplifiedMasks {
 public:
  using MakeExpected = std::function<std::vector<BrickMask>()>;

  /// \param volume    must outlive the object
  /// \param expected  makes the expected masks of simplifiedMask() when they are first needed
  explicit SimplifiedMasks(const SparseVolume& volume, MakeExpected expected = {})
      : volume_(volume), makeExpected_(std::move(expected)) {}

  /// The mask for an error, which is rounded to a power of two. It is kept as long as the object.
  [[nodiscard]] std::span<const BrickMask> forError(double error) const;

 private:
  const SparseVolume& volume_;
  MakeExpected makeExpected_;
  mutable std::mutex making_;
  mutable std::optional<std::vector<BrickMask>> expected_;
  mutable std::map<int, std::vector<BrickMask>> byExponent_;
};

}  // namespace esvr
