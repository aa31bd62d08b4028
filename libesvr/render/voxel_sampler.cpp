#include "render/voxel_sampler.h"

#include <algorithm>

#include "render/vector.h"

namespace esvr {
namespace {

Coord above(int corner) { return {corner >> 2, (corner >> 1) & 1, corner & 1}; }

/// The bricks whose cells read a voxel of the volume's bricks. A cell reaches up to the next voxel
/// along each axis, so these are the volume's bricks and their neighbours below.
std::vector<Coord> bricksWithCells(const SparseVolume& volume) {
  std::vector<Coord> bricks;
  bricks.reserve(8 * volume.bricks.size());
  for (const Coord brick : volume.bricks)
    for (int corner = 0; corner < 8; ++corner) bricks.push_back(brick - above(corner));
  std::sort(bricks.begin(), bricks.end());
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  return bricks;
}

Vec3 corner(Coord brick) {
  return scaled({double(brick.x), double(brick.y), double(brick.z)}, kBrickSide);
}

float between(float a, float b, float s) { return a + s * (b - a); }

}  // namespace

VoxelSampler::VoxelSampler(const SparseVolume& volume)
    : volume_(volume), index_(bricksWithCells(volume)) {
  const BrickIndex stored(volume.bricks);
  for (const Coord brick : index_.bricks()) {
    Corners corners;
    for (int c = 0; c < 8; ++c) corners[c] = stored.find(brick + above(c));
    corners_.push_back(corners);
  }
  Box box;
  for (const Coord brick : volume.bricks) box.expand(brick);
  low_ = difference(corner(box.min), {1.0, 1.0, 1.0});
  high_ = corner(box.max + Coord{1, 1, 1});
}

float VoxelSampler::value(const Corners& corners, Coord local) const {
  const Coord step = brickOf(local);
  const std::uint32_t brick = corners[step.x << 2 | step.y << 1 | step.z];
  if (brick == BrickIndex::kNone) return volume_.background;
  return volume_.values[std::size_t(brick) * kBrickVoxels + voxelOffset(localOf(local))];
}

float VoxelSampler::interpolate(const Corners& corners, const Cell& cell) const {
  const Coord local = localOf(cell.voxel);
  float v[8];
  for (int c = 0; c < 8; ++c) v[c] = value(corners, local + above(c));
  const auto [x, y, z] = cell.fraction;
  const float low = between(between(v[0], v[1], z), between(v[2], v[3], z), y);
  const float high = between(between(v[4], v[5], z), between(v[6], v[7], z), y);
  return between(low, high, x);
}

}  // namespace esvr
