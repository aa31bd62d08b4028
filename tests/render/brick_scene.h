#pragma once
/// Volumes of full bricks, and a picture of them.

#include <utility>
#include <vector>

#include "esvr/render.h"
#include "field/random_field.h"

namespace esvr::test {

/// Bricks at these corners, full of random values from 0 to 1.
inline SparseVolume randomBricks(const std::vector<Coord>& corners, std::uint64_t seed,
                                 float background = 0.0f) {
  Random random(seed);
  std::vector<BrickInput> bricks;
  for (const Coord corner : corners) {
    BrickInput brick{corner, {}, {}};
    for (float& v : brick.values) v = float(random(0.0, 1.0));
    brick.active.setAll();
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), background);
}

inline RenderOptions optionsFor(const SparseVolume& volume, const CameraWish& wish = {}) {
  RenderOptions o;
  o.resolution = {45, 38};
  o.camera = fitCamera(activeBox(volume), wish, o.resolution);
  o.transfer = {builtInColorMap("turbo"), builtInOpacity("linear")};
  o.opacityLength = 10.0;
  o.lod = LevelOfDetail::kOff;
  return o;
}

}  // namespace esvr::test
