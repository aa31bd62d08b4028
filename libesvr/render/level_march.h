#pragma once
/// Marches a ray through the levels of detail of a volume. The code is compiled for host and device.

#include "render/brick_march.h"
#include "render/level_of_detail.h"

namespace esvr {

/// The bricks of cells of a level, and what rays need in it.
struct LevelView {
  BrickTableView table;        ///< in the voxels of the level
  PlaceBox box;                ///< box of the cells, relative to the table's origin
  TransferTableView transfer;  ///< for the steps of the level
};

struct LevelScene {
  MarchScene scene;  ///< in the index space of level 0; its box and table are not used
  LevelBounds bounds;
  LevelView levels[kLevels];  ///< from bounds.first to bounds.last

  /// \param place  0 for the level bounds.first, 1 for the next one, and so on
  [[nodiscard]] ESVR_HD LevelFrame frame(int place) const { return {bounds.first + place}; }
  /// The scene of a level, relative to the origin of its table.
  [[nodiscard]] ESVR_HD MarchScene at(int place) const {
    MarchScene s = sceneOfLevel(scene, frame(place), levels[place].table.origin);
    s.box = levels[place].box;
    s.rule.table = levels[place].transfer;
    return s;
  }
  /// The place of the coarsest level.
  [[nodiscard]] ESVR_HD int last() const { return bounds.last - bounds.first; }
};

/// What is known about a scene when code is compiled, which is then faster.
struct MarchCode {
  bool hasOneLevel = false;
  bool isUsual = false;  ///< RenderMode::kComposite and Classification::kPreIntegrated
  bool isShaded = false;
};
/// What is known about a scene.
[[nodiscard]] inline MarchCode codeFor(const LevelScene& s) {
  return {s.bounds.oneLevel(),
          s.scene.rule.mode == RenderMode::kComposite &&
              s.scene.rule.classification == Classification::kPreIntegrated,
          s.scene.isShaded};
}

namespace level_march {

/// Samples of level 0 as samples of another level.
ESVR_HD inline SampleRange samplesOfLevel(const SampleRange& r, LevelFrame frame) {
  return {std::ceil(r.first / frame.side()), std::floor(r.last / frame.side())};
}

/// The samples of a level. The sample at which the next level begins belongs to both, so that the
/// segment before it is drawn in this one.
/// \param wanted  samples of level 0
ESVR_HD inline SampleRange rangeOf(const LevelScene& s, int place, const SampleRange& wanted) {
  const LevelFrame frame = s.frame(place);
  SampleRange own = wanted;
  if (place > 0) own.first = s.bounds.begin[frame.level] + frame.side();
  if (place < s.last()) own.last = s.bounds.begin[frame.level + 1];
  return samplesOfLevel(own.both(wanted), frame);
}

/// The index of a sample of level 0 in a level (SampleNumber::index).
ESVR_HD inline std::uint32_t indexOf(const MarchScene& scene, const Ray& ray, LevelFrame frame,
                                     double sample) {
  return std::uint32_t(std::int64_t(sample / frame.side() - samplesInScene(scene, ray).first));
}

/// Prepares a ray for the next level.
ESVR_HD inline void passOn(const LevelScene& s, int column, int row, RayProgress& at) {
  const MarchScene from = s.at(at.level), to = s.at(at.level + 1);
  const LevelFrame before = s.frame(at.level), behind = s.frame(at.level + 1);
  const double shared = s.bounds.begin[behind.level];
  from.rule.passOn(at.ray, indexOf(from, from.view.ray(column, row), before, shared),
                   indexOf(to, to.view.ray(column, row), behind, shared),
                   Shades{at.shade, at.shade});
  ++at.level;
  at.next = 0;
}

/// Marches through one level.
template <MarchCode kCode, class Slots, class Visitor>
ESVR_HD inline bool marchLevel(const LevelScene& s, int place, const Slots& slots, int column,
                               int row, const SampleRange& wanted, RayProgress& at,
                               Visitor& visitor) {
  MarchScene scene = s.at(place);
  if constexpr (kCode.isUsual) {
    scene.rule.mode = RenderMode::kComposite;
    scene.rule.classification = Classification::kPreIntegrated;
  }
  const MarchSamples samples = samplesOf(scene, column, row, rangeOf(s, place, wanted));
  const BrickTableView& table = s.levels[place].table;
  if constexpr (kCode.isShaded) {
    const Vec3 direction = scene.view.ray(column, row).direction;
    const LitSamples lit{scene.light, floatPlace(scene.view.inCameraSpace(direction))};
    return marchBricks(table, slots, scene, samples, at, visitor, lit);
  } else {
    return marchBricks(table, slots, scene, samples, at, visitor);
  }
}

}  // namespace level_march

/// The color of a ray that has ended.
[[nodiscard]] ESVR_HD inline PixelColor finished(const LevelScene& s, const RayProgress& at) {
  return s.at(at.level).rule.finished(at.ray, Shades{at.shade, at.shade});
}

/// Adds samples to a ray until it ends or meets a brick that is missing; see marchBricks().
/// \tparam kCode   what is known about the scene when the code is compiled
/// \param wanted  range of samples, as numbers of level 0
template <MarchCode kCode, class Slots, class Visitor>
ESVR_HD inline bool marchLevels(const LevelScene& s, const Slots& slots, int column, int row,
                                const SampleRange& wanted, RayProgress& at, Visitor& visitor) {
  using namespace level_march;
  if constexpr (kCode.hasOneLevel) {
    return marchLevel<kCode>(s, 0, slots, column, row, wanted, at, visitor);
  } else {
    for (;; passOn(s, column, row, at)) {
      if (!marchLevel<kCode>(s, at.level, slots, column, row, wanted, at, visitor)) return false;
      if (at.level == s.last() || !s.scene.rule.open(at.ray)) return true;
    }
  }
}

}  // namespace esvr
