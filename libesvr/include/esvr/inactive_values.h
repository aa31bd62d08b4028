#pragma once
/// The values of a grid's inactive voxels and tiles that are not the background. A SparseVolume does
/// not hold them, and neither does a converted grid; a carried grid does. Applications differ in what
/// they make of them: OpenVDB's tools skip them, Blender draws those in leaves with active voxels.

#include <cstdint>
#include <string>

#include "esvr/coord.h"

namespace esvr {

/// Counts values and remembers enough of them to compare two grids. In a level set, the background
/// with a negative sign is not counted where a writer restores it (EmptySigns::agree).
class InactiveValues {
 public:
  /// Adds the value of a voxel.
  void add(double value, Coord voxel) { add(value, Box{voxel, voxel}); }
  /// Adds the value of all voxels of a tile. The time follows the side of the tile in blocks of 128.
  void add(double value, const Box& tile);
  void add(const InactiveValues& others);
  /// The values of a component of vectors, which differ from equal ones of another component.
  [[nodiscard]] InactiveValues ofComponent(std::size_t component) const;

  /// Number of values, with one for every voxel of a tile.
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double min() const { return min_; }  ///< of the finite values; 0 if there is none
  [[nodiscard]] double max() const { return max_; }
  [[nodiscard]] std::uint64_t nonFinite() const { return nonFinite_; }
  [[nodiscard]] Coord first() const { return first_; }  ///< one of the voxels

  /// True if two grids have the same values at the same voxels. The division into leaves and tiles
  /// does not matter. Different grids are equal with a probability of about 2^-64.
  friend bool operator==(const InactiveValues& a, const InactiveValues& b) {
    return a.count_ == b.count_ && a.digest_ == b.digest_;
  }

 private:
  std::uint64_t count_ = 0, nonFinite_ = 0;
  double min_ = 0.0, max_ = 0.0;
  Coord first_{};
  /// The sum of f(value) g(x) g(y) g(z) over the voxels, with hashes f and g, modulo 2^64. The sum
  /// over a tile is a product of sums along the axes.
  std::uint64_t digest_ = 0;
};

/// For messages: "2 inactive values (5, first at (1, 2, 3))", "9 inactive values (-2.5 to -2, ...)".
[[nodiscard]] std::string toText(const InactiveValues& values);

}  // namespace esvr
