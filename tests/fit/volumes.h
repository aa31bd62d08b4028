#pragma once
/// Volumes of bricks, and small ones that suit fits, for several folders of tests.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "esvr/field.h"
#include "esvr/volume.h"
#include "field/random_field.h"

namespace esvr::test {

template <class Visit>
void forEachVoxel(const Box& box, const Visit& visit) {
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) visit(Coord{x, y, z});
}

// ---- Bricks

/// The coordinates of the bricks of a cube.
inline std::vector<Coord> cubeOfBricks(int side) {
  std::vector<Coord> bricks;
  forEachVoxel({{0, 0, 0}, {side - 1, side - 1, side - 1}}, [&](Coord b) { bricks.push_back(b); });
  return bricks;
}

/// The index coordinates of their first voxels.
inline std::vector<Coord> cornersOfCube(int side, Coord corner = {}) {
  std::vector<Coord> corners = cubeOfBricks(side);
  for (Coord& c : corners) c = corner + c * kBrickSide;
  return corners;
}

/// The bricks of a volume, of which another one can be made.
inline std::vector<BrickInput> bricksOf(const SparseVolume& volume) {
  std::vector<BrickInput> bricks;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    bricks.push_back({volume.brickCorner(b), {}, volume.active[b]});
    std::copy_n(volume.brickValues(b).begin(), kBrickVoxels, bricks.back().values.begin());
  }
  return bricks;
}

/// Bricks at these corners. Functions of the place of a voxel tell its value and whether it is active.
template <class Value, class IsActive>
SparseVolume bricksAt(const std::vector<Coord>& corners, float background, const Value& value,
                      const IsActive& isActive) {
  std::vector<BrickInput> bricks;
  for (const Coord corner : corners) {
    BrickInput& brick = bricks.emplace_back(BrickInput{corner, {}, {}});
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = corner + voxelLocal(v);
      brick.values[std::size_t(v)] = float(value(at));
      if (isActive(at)) brick.active.set(v);
    }
  }
  return makeVolume(std::move(bricks), background);
}

/// The same with all voxels active.
template <class Value>
SparseVolume fullBricks(const std::vector<Coord>& corners, float background, const Value& value) {
  return bricksAt(corners, background, value, [](Coord) { return true; });
}

/// Bricks at these corners, full of random values from 0 to 1.
inline SparseVolume randomBricks(const std::vector<Coord>& corners, std::uint64_t seed,
                                 float background = 0.0f) {
  Random random(seed);
  return fullBricks(corners, background, [&](Coord) { return random(0.0, 1.0); });
}

/// A cube of bricks whose voxels are a function of their index coordinates. Voxels that differ from
/// the background are active.
inline SparseVolume volumeOf(Coord corner, int bricks, float background,
                             const std::function<float(Coord)>& value) {
  auto input = bricksOf(fullBricks(cornersOfCube(bricks, corner), background, value));
  for (BrickInput& brick : input)
    for (int v = 0; v < kBrickVoxels; ++v)
      if (brick.values[std::size_t(v)] == background) brick.active.reset(v);
  return makeVolume(std::move(input), background);
}

/// What two volumes differ in first, values bit by bit; or "".
inline std::string volumeDifference(const SparseVolume& a, const SparseVolume& b) {
  const auto bitsDiffer = [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) != std::bit_cast<std::uint32_t>(y);
  };
  if (a.origin != b.origin) return "the origin";
  if (bitsDiffer(a.background, b.background)) return "the background";
  if (a.bricks != b.bricks) return "the bricks";
  if (a.active != b.active) return "the active voxels";
  const int values = std::inner_product(a.values.begin(), a.values.end(), b.values.begin(), 0,
                                        std::plus<>(), bitsDiffer);
  return values == 0 ? "" : std::to_string(values) + " values";
}

// ---- Volumes for fits

/// The voxels of a field that ellipsoids can represent exactly.
inline SparseVolume ellipsoidVolume(std::size_t count, double lowest, double highest,
                                    Coord shift = {}, double scale = 1.0) {
  Field field =
      randomField({.count = count, .extent = 30.0, .smallest = 1.5, .aspect = 2.0, .seed = 9});
  Random random(17);
  for (float& i : field.chunks[0].ellipsoids.intensity) i = float(random(lowest, highest) * scale);
  field.chunks[0].origin = shift;
  return revoxelise(field, {.threshold = 0.0f});
}

/// A bent tube with soft walls, as small example of thin structures.
inline SparseVolume tubeVolume(Coord shift = {}) {
  return volumeOf(shift, 5, 0.0f, [&](Coord v) {
    const Coord c = v - shift;
    const double axis = 20.0 + 8.0 * std::sin(c.x * 0.2);
    const double r = std::hypot(c.y - axis, c.z - 18.0);
    return r < 4.0 ? float(std::min(1.0, 4.0 - r)) : 0.0f;
  });
}

/// The narrow band of a ball as a level set. The background is 3, the inside -3, and bricks without
/// a voxel of the band are left out.
inline SparseVolume levelSetVolume() {
  const auto distance = [](Coord v) {
    const double d = std::hypot(v.x - 23.5, v.y - 23.5, v.z - 23.5) - 19.0;
    return float(std::clamp(d, -3.0, 3.0));
  };
  return bricksAt(cornersOfCube(6), 3.0f, distance,
                  [&](Coord v) { return std::abs(distance(v)) < 3.0f; });
}

inline bool sameBits(const Field& a, const Field& b) {
  if (a.chunks.size() != b.chunks.size()) return false;
  for (std::size_t c = 0; c < a.chunks.size(); ++c) {
    const Ellipsoids &x = a.chunks[c].ellipsoids, &y = b.chunks[c].ellipsoids;
    if (x.center != y.center || x.logScale != y.logScale || x.rotation != y.rotation ||
        x.intensity != y.intensity || x.kappa != y.kappa)
      return false;
  }
  return true;
}

}  // namespace esvr::test
