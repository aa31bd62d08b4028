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

/// The voxels of a grid.
/// \tparam T  float, std::int32_t, std::int64_t, PackedVector, or bool for a mask, whose active
///            voxels are all true and take no memory
template <class T>
struct PackedVoxels {
  T background{};
  std::vector<PackedBrick> bricks;  ///< in strictly increasing order of their corners
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
    std::variant<PackedVoxels<float>, PackedVoxels<std::int32_t>, PackedVoxels<std::int64_t>,
                 PackedVoxels<bool>, PackedVoxels<PackedVector>>;

/// The descriptor's value type and background have no meaning.
struct PackedGrid {
  GridDescriptor descriptor;
  AnyPackedVoxels voxels;
};

/// OpenVDB's name of the type: "float", "int32", "int64", "bool" or "vec3s".
[[nodiscard]] std::string valueTypeOf(const PackedGrid& grid);
[[nodiscard]] std::span<const PackedBrick> bricksOf(const PackedGrid& grid);
[[nodiscard]] std::uint64_t activeVoxelCount(const PackedGrid& grid);
/// Bounding box of the active voxels; empty if there are none.
[[nodiscard]] Box activeBox(const PackedGrid& grid);

/// The active voxels of a volume.
[[nodiscard]] PackedVoxels<float> packed(const SparseVolume& volume);
/// The vectors of voxels that are active in any component.
[[nodiscard]] PackedVoxels<PackedVector> packed(const VectorGrid& vectors);
[[nodiscard]] SparseVolume unpacked(const PackedVoxels<float>& voxels);

/// A box of an image in memory, in any order of its axes.
template <class Source>
struct ImageBox {
  const Source* voxels = nullptr;           ///< the voxel at `corner`
  std::array<std::ptrdiff_t, 3> strides{};  ///< from a voxel to its neighbour along each axis
  Coord corner;                             ///< multiples of 8
  Coord size;
  /// Says which voxels are active, with strides of its own; null: PackingRule decides.
  const bool* active = nullptr;
  std::array<std::ptrdiff_t, 3> activeStrides{};
};

/// A voxel is active if it is not below the threshold, or, without a threshold, if it differs from
/// the background. A vector has no threshold.
struct PackingRule {
  std::optional<double> threshold{};
  std::uint64_t maxBytes = std::uint64_t{16} << 30;  ///< memory of the grid until it is written
};

/// Makes a grid of boxes of an image that do not overlap.
/// \tparam T       the type of the grid (PackedVoxels)
/// Source types: all numbers up to 32 bits and double for a float grid, of which those of 32 bits
/// and double are rounded; std::int64_t for integers; bool for masks; float triples, given as
/// components, for vectors.
template <class T>
class GridPacker {
 public:
  GridPacker(T background, const PackingRule& rule) : rule_(rule) { made_.background = background; }

  /// \param components  the boxes of a vector's components; one box for all other types
  /// \throws UsageError      the corner is not a multiple of 8
  /// \throws MemoryExceeded  the grid needs more memory than the rule allows
  template <class Source>
  void add(std::span<const ImageBox<Source>> components);

  /// \throws UsageError  boxes overlapped
  [[nodiscard]] PackedVoxels<T> finish();

 private:
  PackingRule rule_;
  PackedVoxels<T> made_;
  std::uint64_t valueBytes_ = 0;
};

}  // namespace esvr
