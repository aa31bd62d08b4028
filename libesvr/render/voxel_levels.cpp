#include "render/voxel_levels.h"

#include <algorithm>

#include "core/brick_index.h"
#include "core/cell_corner.h"
#include "core/parallel.h"
#include "render/cell_bricks.h"
#include "render/level_of_detail.h"

namespace esvr {
namespace {

constexpr int kHalf = kBrickSide / 2;

/// The mean of eight voxels, of which the lowest is given.
float meanAt(std::span<const float, kBrickVoxels> voxels, Coord low) {
  float eight[kCellCorners];
  for (int c = 0; c < kCellCorners; ++c)
    eight[c] = voxels[std::size_t(voxelOffset(low + stepToCorner(c)))];
  return meanOf(eight);
}

/// Fills a brick of the coarser level. \param brick  not relative to the volume's origin
void fillCoarser(const SparseVolume& volume, const BrickIndex& index, Coord brick,
                 std::span<float, kBrickVoxels> values) {
  std::ranges::fill(values, volume.background);
  for (int c = 0; c < kCellCorners; ++c) {
    const std::uint32_t from = index.find(brick * 2 + stepToCorner(c) - brickOf(volume.origin));
    if (from != BrickIndex::kNone)
      averageInto(std::span<const float, kBrickVoxels>(volume.brickValues(from)), c, values);
  }
}

}  // namespace

void averageInto(std::span<const float, kBrickVoxels> voxels, int corner,
                 std::span<float, kBrickVoxels> coarser) {
  const Coord from = stepToCorner(corner) * kHalf;
  for (int x = 0; x < kHalf; ++x)
    for (int y = 0; y < kHalf; ++y)
      for (int z = 0; z < kHalf; ++z)
        coarser[std::size_t(voxelOffset(from + Coord{x, y, z}))] =
            meanAt(voxels, {2 * x, 2 * y, 2 * z});
}

SparseVolume coarserVolume(const SparseVolume& volume) {
  SparseVolume coarser;
  coarser.background = volume.background;
  std::vector<Coord> places(volume.bricks);
  for (Coord& place : places) place = place + brickOf(volume.origin);
  coarser.bricks = coarserBricks(places);
  Box box;
  for (const Coord brick : coarser.bricks) box.expand(brick);
  const Coord low = coarser.bricks.empty() ? Coord{} : box.min;
  const BrickIndex index(volume.bricks);
  coarser.origin = low * kBrickSide;
  coarser.values.resize(coarser.bricks.size() * kBrickVoxels);
  coarser.active.resize(coarser.bricks.size());
  parallelFor(std::size_t(0), coarser.bricks.size(), [&](std::size_t i) {
    fillCoarser(volume, index, coarser.bricks[i],
                std::span<float, kBrickVoxels>(coarser.brickValues(i)));
    coarser.bricks[i] = coarser.bricks[i] - low;
  });
  return coarser;
}

void VolumeLevels::prepare(int last) {
  while (int(coarser_.size()) < last)
    coarser_.push_back(coarserVolume((*this)[int(coarser_.size())]));
}

}  // namespace esvr
