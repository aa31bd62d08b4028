#include "render/voxel_sampler.h"

#include "render/cell_bricks.h"
#include "render/vector.h"

namespace esvr {
namespace {

Vec3 corner(Coord brick) { return scaled(pointOf(brick), kBrickSide); }

float between(float a, float b, float s) { return a + s * (b - a); }

}  // namespace

VoxelSampler::VoxelSampler(const SparseVolume& volume)
    : volume_(volume), index_(bricksWithCells(volume.bricks)) {
  const BrickIndex stored(volume.bricks);
  for (const Coord brick : index_.bricks()) {
    Corners corners;
    for (int c = 0; c < kCellCorners; ++c) corners[c] = stored.find(brick + stepToCorner(c));
    corners_.push_back(corners);
  }
  Box box;
  for (const Coord brick : volume.bricks) box.expand(brick);
  low_ = difference(corner(box.min), {1.0, 1.0, 1.0});
  high_ = corner(box.max + Coord{1, 1, 1});
}

float VoxelSampler::value(const Corners& corners, Coord local) const {
  const std::uint32_t brick = corners[cornerAt(brickOf(local))];
  if (brick == BrickIndex::kNone) return volume_.background;
  return volume_.values[std::size_t(brick) * kBrickVoxels + voxelOffset(localOf(local))];
}

float VoxelSampler::interpolate(const Corners& corners, const Cell& cell) const {
  const Coord local = localOf(cell.voxel);
  float v[kCellCorners];
  for (int c = 0; c < kCellCorners; ++c) v[c] = value(corners, local + stepToCorner(c));
  const auto [x, y, z] = cell.fraction;
  const float low = between(between(v[0], v[1], z), between(v[2], v[3], z), y);
  const float high = between(between(v[4], v[5], z), between(v[6], v[7], z), y);
  return between(low, high, x);
}

}  // namespace esvr
