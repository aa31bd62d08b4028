#pragma once
/// How sums of ellipsoids become voxels: the rule that revoxelise() applies to a value, and where voxels
/// of a brick may be active. The parameters are explained in RevoxeliseOptions (field.h). The rule and
/// LocalBox are compiled for host and device.

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "esvr/ellipsoids.h"
#include "esvr/field.h"
#include "esvr/tone.h"
#include "esvr/volume.h"

namespace esvr {

struct VoxelRule {
  float background = 0.0f;
  float low = -std::numeric_limits<float>::infinity();  ///< smaller sums are clamped to this
  float high = std::numeric_limits<float>::infinity();  ///< larger sums are clamped to this
  float threshold = 0.0f;
  bool narrowBand = false;
  ToneCurve tone{};  ///< sums are tones; the other members are values

  /// The clamped value of a sum, which is the value of an active voxel.
  [[nodiscard]] ESVR_HD float settled(float sum) const {
    const float value = tone.value(sum);
    return value < low ? low : (high < value ? high : value);
  }
  /// The activity of a settled value. A voxel is active if it is above the threshold.
  [[nodiscard]] ESVR_HD float activity(float settled) const {
    return narrowBand ? background - std::fabs(settled) : std::fabs(settled - background);
  }
  [[nodiscard]] ESVR_HD bool isActive(float settled) const { return activity(settled) > threshold; }
  /// The value of an inactive voxel.
  [[nodiscard]] ESVR_HD float inactiveValue(float settled) const {
    return narrowBand ? std::copysign(background, settled) : background;
  }
  /// The value of the voxel that a sum becomes.
  [[nodiscard]] ESVR_HD float operator()(float sum) const {
    const float value = settled(sum);
    return isActive(value) ? value : inactiveValue(value);
  }
};

/// \param options  its bricks are not used
[[nodiscard]] inline VoxelRule makeVoxelRule(float background, const RevoxeliseOptions& options) {
  VoxelRule rule{.background = background};
  if (options.range) rule.low = options.range->min, rule.high = options.range->max;
  rule.threshold = options.threshold;
  rule.narrowBand = options.narrowBand;
  rule.tone = options.tone;
  return rule;
}

/// The part of a box within the voxels 0 to `last` of a brick along each axis, counted from the
/// brick's first voxel. If it is empty, high is below low along an axis.
struct LocalBox {
  int low[3], high[3];

  [[nodiscard]] ESVR_HD bool contains(int x, int y, int z) const {
    return x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1] && z >= low[2] &&
           z <= high[2];
  }
};

/// \param corner  index coordinates of the brick's first voxel
/// \param last    the last voxel along each axis, for example kBrickSide - 1
ESVR_HD inline LocalBox localBox(const Box& box, const Coord& corner, int last) {
  const auto within = [last](std::int64_t place, int below, int above) {
    return place < below ? below : (place > last + above ? last + above : int(place));
  };
  const auto from = [&](std::int32_t at, std::int32_t first) {
    return within(std::int64_t(at) - first, 0, 1);
  };
  const auto to = [&](std::int32_t at, std::int32_t first) {
    return within(std::int64_t(at) - first, -1, 0);
  };
  return {{from(box.min.x, corner.x), from(box.min.y, corner.y), from(box.min.z, corner.z)},
          {to(box.max.x, corner.x), to(box.max.y, corner.y), to(box.max.z, corner.z)}};
}

/// How the voxels of one brick become active.
struct BrickRegion {
  BrickMask within;  ///< no other voxel is active
  BrickMask
      certain;  ///< these are active whatever their values; the rule of values decides about the others

  /// \param v  voxelOffset of a voxel, of which `settled` is the value by the rule
  [[nodiscard]] bool isActive(const VoxelRule& rule, int v, float settled) const {
    return within.test(v) && (certain.test(v) || rule.isActive(settled));
  }
};

/// The voxels of a brick that lie in a box. \param corner  its first voxel
[[nodiscard]] BrickMask maskOf(const Box& box, Coord corner);

/// \param corner  index coordinates of the brick's first voxel
[[nodiscard]] BrickRegion regionIn(const RevoxeliseOptions& options, Coord corner);

/// The bricks (increasing index corners) that may have an active voxel.
/// \throws MemoryExceeded  as for reachedBricks
[[nodiscard]] std::vector<Coord> voxelBricks(const Field& field, const RevoxeliseOptions& options);

/// Turns the sums of one brick into voxels. \return the mask of its active voxels
BrickMask settle(const VoxelRule& rule, const BrickRegion& region, std::span<float> values);

}  // namespace esvr
