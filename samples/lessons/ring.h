#pragma once
// The volume of the lessons: a soft ring, built as lesson 1 explains; and the check of their
// claims, because the lessons are tests as well.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "esvr/volume.h"

inline float ringValue(esvr::Coord v) {
  constexpr float kRadius = 16.0f, kThickness = 4.0f;
  const float x = float(v.x), y = float(v.y), z = float(v.z);
  const float fromCircle = std::hypot(x, y) - kRadius;
  const float distance = std::hypot(fromCircle, z) / kThickness;
  return std::max(0.0f, 1.0f - distance * distance);
}

inline esvr::SparseVolume makeRing() {
  std::vector<esvr::BrickInput> bricks;
  for (int x = -24; x < 24; x += esvr::kBrickSide)
    for (int y = -24; y < 24; y += esvr::kBrickSide)
      for (int z = -8; z < 8; z += esvr::kBrickSide) {
        esvr::BrickInput brick{.corner = {x, y, z}, .values = {}, .active = {}};
        for (int i = 0; i < esvr::kBrickVoxels; ++i) {
          const float value = ringValue(brick.corner + esvr::voxelLocal(i));
          brick.values[std::size_t(i)] = value;
          if (value > 0.0f) brick.active.set(i);
        }
        bricks.push_back(brick);
      }
  return esvr::makeVolume(std::move(bricks), 0.0f);  // drops bricks without an active voxel
}

inline void check(bool condition, const char* claim) {
  std::printf("%s: %s\n", condition ? "true" : "FALSE", claim);
  if (!condition) std::exit(EXIT_FAILURE);
}
