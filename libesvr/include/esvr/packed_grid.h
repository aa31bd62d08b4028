#pragma once
/// Grids of which only the active voxels are in memory, in the type that they have in a .vdb file:
/// numbers, integers with all their bits, masks and vectors. An image becomes such a grid slab by
/// slab, so that neither the image nor the inactive voxels of its bricks are ever in memory as a
/// whole. A fit needs a SparseVolume; unpacked() makes one of numbers.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "esvr/grid_descriptor.h"
#include "esvr/sparse_volume.h"
#include "esvr/vector_grid.h"

namespace esvr {

using PackedVector = std::array<float, kComponents>;

/// A brick with an active voxel.
struct PackedBrick {
  Coord corner;  ///< index coordinates of the first voxel, multiples of 8
  BrickMask active;
  std::uint32_t part = 0;   ///< the array that holds the values of the active voxels
  std::uint64_t first = 0;  ///< index of the first one in it
};

/// What a brick takes besides its values until its grid is written: its entry here, and OpenVDB's leaf
/// without voxels.
inline constexpr std::uint64_t kBytesPerPackedBrick = sizeof(PackedBrick) + 160;

/// The voxels of a grid.
/// \tparam T  float, double, std::int32_t, std::int64_t, PackedVector, or bool for a mask, whose
///            active voxels are all true and take no memory
template <class T>
struct PackedVoxels {
  T background{};
  std::vector<PackedBrick> bricks;  ///< Their corners increase strictly.
  /// Values of active voxels, in the order of voxelOffset in each brick.
  std::vector<std::vector<T>> parts;

  /// The value of the n-th active voxel of brick b.
  [[nodiscard]] T value(std::size_t b, int n) const {
    if constexpr (std::is_same_v<T, bool>)
      return true;
    else
      return parts[bricks[b].part][bricks[b].first + std::size_t(n)];
  }
};

using AnyPackedVoxels =
    std::variant<PackedVoxels<float>, PackedVoxels<double>, PackedVoxels<std::int32_t>,
                 PackedVoxels<std::int64_t>, PackedVoxels<bool>, PackedVoxels<PackedVector>>;

/// The descriptor's value type and background have no meaning.
struct PackedGrid {
  GridDescriptor descriptor;
  AnyPackedVoxels voxels;
};

/// OpenVDB's name of the type: "float", "double", "int32", "int64", "bool" or "vec3s".
[[nodiscard]] std::string valueTypeOf(const PackedGrid& grid);
[[nodiscard]] std::span<const PackedBrick> bricksOf(const PackedGrid& grid);
[[nodiscard]] std::uint64_t activeVoxelCount(const PackedGrid& grid);
/// Bounding box of the active voxels; empty if there are none.
[[nodiscard]] Box activeBox(const PackedGrid& grid);

/// Calls visit(offset) for the active voxels of a brick in the order of voxelOffset.
template <class Visit>
void forEachActive(const BrickMask& mask, Visit&& visit) {
  for (int x = 0; x < kBrickSide; ++x)
    for (std::uint64_t word = mask.words[std::size_t(x)]; word; word &= word - 1)
      visit(x * 64 + std::countr_zero(word));
}

/// The active voxels of a volume: doubles if its descriptor says that the source was double, else
/// floats. The sign that inactive voxels of a level set have is lost.
[[nodiscard]] PackedGrid packed(const GridDescriptor& descriptor, const SparseVolume& volume);
/// The vectors of the voxels that are active in any component, as floats.
[[nodiscard]] PackedGrid packed(const VectorGrid& vectors);
/// \throws BadInput  bricks are more than 2^31 voxels apart
[[nodiscard]] SparseVolume unpacked(const PackedVoxels<float>& voxels);

/// A box of an image in memory, in any order of its axes.
template <class Source>
struct ImageBox {
  const Source* voxels = nullptr;  ///< the voxel at `corner`
  std::array<std::ptrdiff_t, 3>
      strides{};  ///< elements from a voxel to the next one along each axis
  Coord corner;   ///< multiples of 8
  Coord size;
  /// Says which voxels are active, with strides of its own; null: PackingRule decides.
  const bool* active = nullptr;
  std::array<std::ptrdiff_t, 3> activeStrides{};
};

/// Where a box does not say which voxels are active, a voxel is active if it is not below the
/// threshold, or, without a threshold, if it differs from the background. NaN is below every threshold
/// and differs from every background. A vector has no threshold and is active if any component
/// differs. Of a mask, only true voxels are ever active.
struct PackingRule {
  std::optional<double> threshold{};
  std::uint64_t maxBytes = std::uint64_t{16} << 30;  ///< memory of the grid until it is written
};

/// Makes a grid of boxes of an image that do not overlap, and of which each brick of 8^3 voxels has
/// voxels of one box only.
/// \tparam T  the type of the grid (PackedVoxels)
/// No value is rounded, so that T decides which types an image may have:
///   float         8 and 16 bits, float
///   double        8 to 32 bits, float, double
///   std::int32_t  8 to 32 bits with a sign, 8 and 16 bits without one
///   std::int64_t  8 to 64 bits with a sign, 8 to 32 bits without one
///   bool          bool
///   PackedVector  float, given as the boxes of the three components
template <class T>
class GridPacker {
 public:
  GridPacker(T background, const PackingRule& rule) : rule_(rule) { made_.background = background; }

  /// \param components  the boxes of a vector's components; one box for all other types
  /// \throws UsageError      the corner is not a multiple of 8, or the box ends outside the index space
  /// \throws MemoryExceeded  the grid needs more memory than the rule allows
  template <class Source>
  void add(std::span<const ImageBox<Source>> components);

  /// The grid. The packer is empty afterwards. \throws UsageError  two boxes have voxels of one brick
  [[nodiscard]] PackedVoxels<T> finish();

 private:
  PackingRule rule_;
  PackedVoxels<T> made_;
  std::uint64_t valueBytes_ = 0;
};

}  // namespace esvr
