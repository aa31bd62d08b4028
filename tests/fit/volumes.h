#pragma once
/// Small volumes for the tests of the fit.

#include <algorithm>
#include <cmath>
#include <functional>

#include "esvr/field.h"
#include "esvr/volume.h"
#include "field/random_field.h"

namespace esvr::test {

/// A cube of bricks whose voxels are a function of their index coordinates. Voxels that differ from
/// the background are active.
inline SparseVolume volumeOf(Coord corner, int bricks, float background,
                             const std::function<float(Coord)>& value) {
  std::vector<BrickInput> input;
  for (int x = 0; x < bricks; ++x)
    for (int y = 0; y < bricks; ++y)
      for (int z = 0; z < bricks; ++z) {
        BrickInput brick;
        brick.corner = corner + Coord{x, y, z} * kBrickSide;
        for (int v = 0; v < kBrickVoxels; ++v) {
          brick.values[std::size_t(v)] = value(brick.corner + voxelLocal(v));
          if (brick.values[std::size_t(v)] != background) brick.active.set(v);
        }
        input.push_back(brick);
      }
  return makeVolume(std::move(input), background);
}

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
  SparseVolume volume = volumeOf({}, 6, 3.0f, [](Coord v) {
    const double distance = std::hypot(v.x - 23.5, v.y - 23.5, v.z - 23.5) - 19.0;
    return float(std::clamp(distance, -3.0, 3.0));
  });
  std::vector<BrickInput> bricks;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    BrickInput brick{volume.brickCorner(b), {}, {}};
    for (std::size_t v = 0; v < kBrickVoxels; ++v) {
      brick.values[v] = volume.brickValues(b)[v];
      if (std::abs(brick.values[v]) < 3.0f) brick.active.set(int(v));
    }
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), 3.0f);
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
