#include "baselines/dense_box.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "esvr/error.h"

namespace esvr::baselines {
namespace {

/// The part of a brick that lies in a box, in local coordinates.
Box localPart(Coord corner, const Box& box) {
  const Coord last{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1};
  return {maxCoord(box.min - corner, {}), minCoord(box.max - corner, last)};
}

template <class Visit>
void visitVoxels(const Box& local, const Visit& visit) {
  for (int x = local.min.x; x <= local.max.x; ++x)
    for (int y = local.min.y; y <= local.max.y; ++y)
      for (int z = local.min.z; z <= local.max.z; ++z) visit(Coord{x, y, z});
}

/// Appends a brick of the array unless all its voxels are background.
void appendBrick(const DenseBox& dense, Coord corner, float activeAbove, SparseVolume& volume) {
  std::array<float, kBrickVoxels> values;
  values.fill(volume.background);
  BrickMask active;
  bool holdsAny = false;
  visitVoxels(localPart(corner, dense.box), [&](Coord local) {
    const int i = voxelOffset(local);
    values[i] = dense.values[dense.offset(corner + local)];
    const float difference = std::abs(values[i] - volume.background);
    holdsAny |= difference > 0.0f;
    if (difference > activeAbove) active.set(i);
  });
  if (!holdsAny) return;
  volume.bricks.push_back(brickOf(corner - volume.origin));
  volume.values.insert(volume.values.end(), values.begin(), values.end());
  volume.active.push_back(active);
}

}  // namespace

DenseBox densify(const SparseVolume& volume, const Box& box, std::uint64_t maxBytes) {
  const double bytes = box.volume() * sizeof(float);
  if (maxBytes > 0 && bytes > double(maxBytes))
    throw UsageError("the box as an array takes " + std::to_string(std::uint64_t(bytes / 1e6)) +
                     " MB, more than the bound of " + std::to_string(maxBytes / 1'000'000));
  DenseBox dense{box, std::vector<float>(std::size_t(box.volume()), volume.background)};
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const Coord corner = volume.brickCorner(b);
    const auto values = volume.brickValues(b);
    visitVoxels(localPart(corner, box), [&](Coord local) {
      dense.values[dense.offset(corner + local)] = values[voxelOffset(local)];
    });
  }
  return dense;
}

SparseVolume sparsify(const DenseBox& dense, float background, float activeAbove) {
  SparseVolume volume;
  volume.background = background;
  volume.origin = brickOf(dense.box.min) * kBrickSide;
  const Coord first = brickOf(dense.box.min), last = brickOf(dense.box.max);
  for (int x = first.x; x <= last.x; ++x)
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z)
        appendBrick(dense, Coord{x, y, z} * kBrickSide, activeAbove, volume);
  return volume;
}

float activityThreshold(const SparseVolume& volume) {
  float smallest = std::numeric_limits<float>::infinity();
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i) {
      const float difference = std::abs(volume.brickValues(b)[i] - volume.background);
      if (volume.active[b].test(i) && difference > 0.0f) smallest = std::min(smallest, difference);
    }
  return std::isfinite(smallest) ? smallest / 2 : 0.0f;
}

}  // namespace esvr::baselines
