#pragma once
/// Volumes as bricks of cells, the form in which rays march through them (brick_march.h). A cell is
/// the cube between a voxel and its neighbours above along x, y and z; it belongs to the brick of
/// that voxel. Here is which bricks there are, their numbers, their voxels, and their levels of
/// detail.

#include <array>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "esvr/volume.h"
#include "render/brick_march.h"

namespace esvr {

// Places of bricks.

/// The bricks whose first voxels are given.
[[nodiscard]] std::vector<Coord> bricksAt(std::span<const Coord> corners);

/// The bricks of the next coarser level that these bricks belong to, in
/// increasing order.
[[nodiscard]] std::vector<Coord> coarserBricks(std::span<const Coord> bricks);

/// Bricks of which a cell has a corner in one of the bricks of voxels, in increasing order.
/// \param voxels  in increasing order
[[nodiscard]] std::vector<Coord> bricksWithCells(std::span<const Coord> voxels);

// Numbers of bricks, by which a ray finds them.

struct BrickTable {
  Coord origin, blocks;  ///< see BrickTableView
  std::vector<std::uint32_t> blockOf;
  std::vector<BrickRow> rows;
  std::uint32_t first = 0;    ///< number of the first brick; the others follow
  std::vector<Coord> bricks;  ///< in the order of their numbers: place relative to the origin

  [[nodiscard]] BrickTableView view() const {
    return {origin, blocks, blockOf.data(), rows.data()};
  }
  /// The place of a brick in bricks, not relative to the origin.
  [[nodiscard]] Coord place(std::size_t brick) const { return brickOf(origin) + bricks[brick]; }
};

/// Numbers bricks, block by block.
/// \param bricks  all different
/// \param first   number of the first brick
/// \throws UsageError  the bricks lie in a box of more than 2^28 blocks of 64^3 voxels
[[nodiscard]] BrickTable makeBrickTable(std::vector<Coord> bricks, std::uint32_t first = 0);

/// The places of all bricks, not relative to the origin.
[[nodiscard]] std::vector<Coord> placesOf(const BrickTable& table);

/// The box of the cells, relative to the table's origin. It is empty without bricks.
[[nodiscard]] PlaceBox cellsOf(const BrickTable& table);

// Voxels of bricks.

/// The values of a brick of voxels and of its upper neighbours by the number of the corner; null: a
/// brick of the background.
using CornerBricks = std::array<const float*, kCellCorners>;

/// \param find  find(brick) returns the values of a brick of voxels, or null
template <class Find>
[[nodiscard]] CornerBricks cornerBricks(Coord brick, Find&& find) {
  CornerBricks from;
  for (int c = 0; c < kCellCorners; ++c) from[c] = find(brick + stepToCorner(c));
  return from;
}

/// \param cells  output. \return false if all are the background
bool fillCells(const CornerBricks& from, float background,
               std::span<float, kCellBrickVoxels> cells);

/// All bricks of cells of a volume that have a voxel other than the background.
struct BrickAtlas {
  BrickTable table;
  std::vector<float> values;  ///< kCellBrickVoxels for each brick, in the order of the table

  /// Pointers to the pages of the values.
  [[nodiscard]] std::vector<const float*> pages() const;
};

/// \param first   number of the first brick
/// \throws UsageError  as for makeBrickTable
[[nodiscard]] BrickAtlas makeBrickAtlas(const SparseVolume& volume, std::uint32_t first = 0);

// Bricks of voxels of coarser levels of detail.

/// Averages the voxels of a brick. The results are an eighth of a brick of the next coarser level.
/// \param corner  the eighth: the corner of the coarser brick (core/geometry.h) where it lies
/// \param coarser  output
void averageInto(std::span<const float, kBrickVoxels> voxels, int corner,
                 std::span<float, kBrickVoxels> coarser);

/// The next coarser level of a volume. It has no active voxels.
[[nodiscard]] SparseVolume coarserVolume(const SparseVolume& volume);

/// A volume and its coarser levels, which are made when they are first needed.
class VolumeLevels {
 public:
  /// \param volume  must outlive the object
  explicit VolumeLevels(const SparseVolume& volume) : volume_(volume) {}

  /// Makes the levels up to this one.
  void prepare(int last);
  /// \param level  0, or a level that was prepared
  [[nodiscard]] const SparseVolume& operator[](int level) const {
    return level == 0 ? volume_ : coarser_[std::size_t(level) - 1];
  }

 private:
  const SparseVolume& volume_;
  std::vector<SparseVolume> coarser_;
};

}  // namespace esvr
