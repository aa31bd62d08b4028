#include "esvr/sparse_volume.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "esvr/error.h"

namespace esvr {
namespace {

constexpr std::int64_t kMaxExtent = std::int64_t{1} << 31;

Coord smallestCorner(const std::vector<BrickInput>& bricks) {
  Coord origin = bricks.front().corner;
  for (const auto& brick : bricks) origin = minCoord(origin, brick.corner);
  return origin;
}

void refuseTooFarApart(Coord low, const std::vector<BrickInput>& bricks) {
  for (const auto& brick : bricks) {
    const Coord c = brick.corner;
    const auto extent =
        std::max({std::int64_t(c.x) - low.x, std::int64_t(c.y) - low.y, std::int64_t(c.z) - low.z});
    if (extent >= kMaxExtent - kBrickSide)
      throw BadInput("the active voxels at " + toString(low) + " and " + toString(c) +
                     " are 2^31 voxels or more apart");
  }
}

/// The box of a brick's active voxels, in local coordinates.
Box localActiveBox(const BrickMask& mask) {
  Box box;
  for (int offset = 0; offset < kBrickVoxels; ++offset)
    if (mask.test(offset)) box.expand(voxelLocal(offset));
  return box;
}

}  // namespace

std::optional<std::size_t> findBrick(const SparseVolume& volume, Coord brick) {
  const auto it = std::lower_bound(volume.bricks.begin(), volume.bricks.end(), brick);
  if (it == volume.bricks.end() || *it != brick) return std::nullopt;
  return std::size_t(it - volume.bricks.begin());
}

float valueAt(const SparseVolume& volume, Coord voxel) {
  // The difference is formed in bricks, because that of two voxels may exceed 32 bits.
  const auto b = findBrick(volume, brickOf(voxel) - brickOf(volume.origin));
  return b ? volume.brickValues(*b)[voxelOffset(localOf(voxel))] : volume.background;
}

std::uint64_t activeVoxelCount(const SparseVolume& volume) {
  std::uint64_t n = 0;
  for (const auto& mask : volume.active) n += std::uint64_t(mask.count());
  return n;
}

Box activeBox(const SparseVolume& volume) {
  Box box;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const Box local = localActiveBox(volume.active[b]);
    if (local.empty()) continue;
    const Coord corner = volume.brickCorner(b);
    box.expand(Box{corner + local.min, corner + local.max});
  }
  return box;
}

ValueRange activeRange(const SparseVolume& volume) {
  ValueRange range{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const auto values = volume.brickValues(b);
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!volume.active[b].test(i)) continue;
      range.min = std::min(range.min, values[i]);
      range.max = std::max(range.max, values[i]);
    }
  }
  if (range.min > range.max) throw BadInput("the grid has no active voxel");
  return range;
}

void checkInvariants(const SparseVolume& volume) {
  const std::size_t n = volume.bricks.size();
  if (volume.values.size() != n * kBrickVoxels || volume.active.size() != n)
    throw std::logic_error("SparseVolume: arrays of different length");
  const auto notIncreasing = [](Coord a, Coord b) { return !(a < b); };
  if (std::adjacent_find(volume.bricks.begin(), volume.bricks.end(), notIncreasing) !=
      volume.bricks.end())
    throw std::logic_error("SparseVolume: bricks not in increasing order");
  if (localOf(volume.origin) != Coord{})
    throw std::logic_error("SparseVolume: origin is not a brick corner");
}

SparseVolume makeVolume(std::vector<BrickInput> bricks, float background) {
  std::erase_if(bricks, [](const BrickInput& b) { return b.active.count() == 0; });
  SparseVolume volume;
  volume.background = background;
  if (bricks.empty()) return volume;

  std::sort(bricks.begin(), bricks.end(),
            [](const BrickInput& a, const BrickInput& b) { return a.corner < b.corner; });
  volume.origin = smallestCorner(bricks);
  refuseTooFarApart(volume.origin, bricks);

  volume.bricks.reserve(bricks.size());
  volume.active.reserve(bricks.size());
  volume.values.reserve(bricks.size() * kBrickVoxels);
  for (const auto& brick : bricks) {
    const Coord place = brickOf(brick.corner - volume.origin);
    if (!volume.bricks.empty() && volume.bricks.back() == place)
      throw BadInput("two bricks at " + toString(brick.corner));
    volume.bricks.push_back(place);
    volume.active.push_back(brick.active);
    volume.values.insert(volume.values.end(), brick.values.begin(), brick.values.end());
  }
  return volume;
}

}  // namespace esvr
