#pragma once
/// Levels of detail. A voxel of level l is the mean of the 2^l x 2^l x 2^l voxels from 2^l (i, j, k)
/// on, and lies in the middle of them. Where a pixel is wider than a voxel, a ray is sampled in a
/// coarser level and at longer steps. The code is compiled for host and device.

#include <array>

#include "render/march_scene.h"

namespace esvr {

/// Levels 0 to kLevels - 1. Pixels that are wider than a voxel of the coarsest level use it too.
inline constexpr int kLevels = 8;

/// The mean of two values. Neither a value nor its mean with itself overflows or is rounded.
ESVR_HD inline float meanOf(float a, float b) { return 0.5f * a + 0.5f * b; }

/// The mean of eight voxels by the numbers of their corners (core/cell_corner.h). All code that
/// averages uses it, level after level, so that voxels have the same bits however they were made.
ESVR_HD inline float meanOf(const float (&v)[8]) {
  return meanOf(meanOf(meanOf(v[0], v[1]), meanOf(v[2], v[3])),
                meanOf(meanOf(v[4], v[5]), meanOf(v[6], v[7])));
}

/// The voxels of a level in units of those of level 0.
struct LevelFrame {
  int level;

  [[nodiscard]] ESVR_HD double side() const { return double(1 << level); }
  /// Place of voxel (0, 0, 0) along each axis.
  [[nodiscard]] ESVR_HD double offset() const { return 0.5 * (side() - 1.0); }
  /// Converts a place to the index space of the level.
  [[nodiscard]] ESVR_HD Vec3 place(const Vec3& p) const {
    const double perSide = 1.0 / side(), o = offset();
    return {(p[0] - o) * perSide, (p[1] - o) * perSide, (p[2] - o) * perSide};
  }
};

/// The view, clip box and rule of a scene in the index space of a level, relative to an origin there.
/// Sample n of the level is sample n 2^level of level 0.
/// \param scene   in the index space of level 0; its rule's table is not changed
/// \param origin  a voxel of the level
ESVR_HD inline MarchScene sceneOfLevel(const MarchScene& scene, LevelFrame frame,
                                       const Coord& origin) {
  const Vec3 from = pointOf(origin);
  MarchScene s = scene;
  const double perSide = 1.0 / frame.side();
  s.view.eye = difference(frame.place(scene.view.eye), from);
  s.view.before *= perSide;
  if (!s.view.perspective) {
    s.view.pixel *= perSide, s.view.left *= perSide, s.view.top *= perSide;
  }
  s.clip.box = {difference(frame.place(scene.clip.box.low), from),
                difference(frame.place(scene.clip.box.high), from)};
  s.rule.step *= float(frame.side());
  return s;
}

/// The samples of a picture's rays that are drawn in each level. Samples have the numbers of level
/// 0. Level l begins at sample begin[l], a multiple of 2^l, and ends where level l + 1 begins.
struct LevelBounds {
  std::array<double, kLevels + 1> begin;
  int first = 0, last = 0;  ///< levels that rays may meet in the box of the volume

  [[nodiscard]] ESVR_HD bool oneLevel() const { return first == last; }
};

/// \param box  all voxels lie in it
[[nodiscard]] LevelBounds levelBounds(const RenderOptions& options, const View& view,
                                      const PlaceBox& box);

}  // namespace esvr
