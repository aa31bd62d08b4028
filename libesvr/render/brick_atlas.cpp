#include "render/brick_atlas.h"

#include <array>

#include "core/brick_index.h"
#include "core/parallel.h"
#include "render/cell_bricks.h"
#include "render/cell_corners.h"

namespace esvr {
namespace {

/// Reads cells by the place of their brick, which is not relative to the volume's origin.
class CellReader {
 public:
  explicit CellReader(const SparseVolume& volume)
      : volume_(volume), origin_(brickOf(volume.origin)), index_(volume.bricks) {}

  /// Reads the voxels at the corners of a brick's cells. \return false if all are the background
  bool read(Coord brick, std::span<float, kCellBrickVoxels> values) const {
    return fillCells(cornerBricks(brick, [&](Coord at) { return find(at); }), volume_.background,
                     values);
  }

 private:
  [[nodiscard]] const float* find(Coord brick) const {
    const std::uint32_t at = index_.find(brick - origin_);
    return at == BrickIndex::kNone ? nullptr : volume_.brickValues(at).data();
  }

  const SparseVolume& volume_;
  const Coord origin_;
  const BrickIndex index_;
};

std::vector<Coord> placesOf(const SparseVolume& volume) {
  std::vector<Coord> places(volume.bricks);
  for (Coord& place : places) place = place + brickOf(volume.origin);
  return places;
}

/// The candidates that have a voxel other than the background.
std::vector<Coord> occupied(const CellReader& reader, const std::vector<Coord>& all) {
  std::vector<char> any(all.size());
  parallelFor(std::size_t(0), all.size(), [&](std::size_t i) {
    std::array<float, kCellBrickVoxels> values;
    any[i] = reader.read(all[i], values) ? 1 : 0;
  });
  std::vector<Coord> bricks;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (any[i] != 0) bricks.push_back(all[i]);
  return bricks;
}

}  // namespace

std::vector<const float*> BrickAtlas::pages() const {
  std::vector<const float*> pages;
  for (std::size_t first = 0; first < values.size(); first += BrickSlotsView::kPageFloats)
    pages.push_back(values.data() + first);
  return pages;
}

BrickAtlas makeBrickAtlas(const SparseVolume& volume, std::uint32_t first) {
  const CellReader reader(volume);
  BrickAtlas atlas{makeBrickTable(occupied(reader, bricksWithCells(placesOf(volume))), first), {}};
  const std::size_t count = atlas.table.bricks.size();
  atlas.values.resize(count * kCellBrickVoxels);
  parallelFor(std::size_t(0), count, [&](std::size_t i) {
    (void)reader.read(
        atlas.table.place(i),
        std::span<float, kCellBrickVoxels>(&atlas.values[i * kCellBrickVoxels], kCellBrickVoxels));
  });
  return atlas;
}

}  // namespace esvr
