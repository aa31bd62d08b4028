#include "esvr/vector_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"

namespace esvr {
namespace {

constexpr std::array kAxisNames{'x', 'y', 'z'};

/// The corners of all bricks of the components, increasing.
std::vector<Coord> allCorners(const VectorVolume& vectors) {
  std::vector<Coord> corners;
  for (const SparseVolume& volume : vectors)
    for (std::size_t b = 0; b < volume.brickCount(); ++b) corners.push_back(volume.brickCorner(b));
  std::ranges::sort(corners);
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

Coord smallestOf(const std::vector<Coord>& corners) {
  Coord low = corners.empty() ? Coord{} : corners.front();
  for (const Coord corner : corners) low = minCoord(low, corner);
  return low;
}

/// The brick of a volume with this corner.
std::optional<std::size_t> brickWith(const SparseVolume& volume, Coord corner) {
  return findBrick(volume, brickOf(corner) - brickOf(volume.origin));
}

BrickMask unionAt(const VectorVolume& vectors, Coord corner) {
  BrickMask mask;
  for (const SparseVolume& volume : vectors)
    if (const auto b = brickWith(volume, corner))
      for (std::size_t w = 0; w < mask.words.size(); ++w)
        mask.words[w] |= volume.active[*b].words[w];
  return mask;
}

/// A volume of background with bricks at these corners.
SparseVolume laidOut(const SparseVolume& like, const std::vector<Coord>& corners) {
  SparseVolume volume;
  volume.background = like.background;
  volume.origin = smallestOf(corners);
  for (const Coord corner : corners) volume.bricks.push_back(brickOf(corner - volume.origin));
  volume.values = VoxelArray<float>(corners.size() * kBrickVoxels, like.background, memoryOf(like));
  volume.active.resize(corners.size());
  return volume;
}

SparseVolume withBricks(const SparseVolume& volume, const std::vector<Coord>& corners) {
  SparseVolume result = laidOut(volume, corners);
  for (std::size_t b = 0; b < corners.size(); ++b)
    if (const auto own = brickWith(volume, corners[b]))
      std::ranges::copy(volume.brickValues(*own), result.brickValues(b).begin());
  return result;
}

float lengthOf(double x, double y, double z) { return float(std::sqrt(x * x + y * y + z * z)); }

}  // namespace

std::string componentName(const std::string& grid, std::size_t component) {
  return grid + '.' + kAxisNames.at(component);
}

VectorVolume aligned(const VectorVolume& vectors) {
  const auto corners = allCorners(vectors);
  VectorVolume result;
  for (std::size_t c = 0; c < kComponents; ++c) result[c] = withBricks(vectors[c], corners);
  for (std::size_t b = 0; b < corners.size(); ++b)
    for (SparseVolume& volume : result) volume.active[b] = unionAt(vectors, corners[b]);
  return result;
}

SparseVolume magnitudeOf(const VectorVolume& vectors) {
  const VectorVolume all = aligned(vectors);
  const SparseVolume &x = all[0], &y = all[1], &z = all[2];  // a lambda cannot capture bindings
  SparseVolume result = x;
  result.background = lengthOf(x.background, y.background, z.background);
  parallelFor(std::size_t{0}, result.values.size(), [&](std::size_t v) {
    result.values[v] = lengthOf(x.values[v], y.values[v], z.values[v]);
  });
  return result;
}

}  // namespace esvr
