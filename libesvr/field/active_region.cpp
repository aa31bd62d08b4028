#include "field/active_region.h"

#include <algorithm>
#include <optional>

#include "field/local_box.h"

namespace esvr {
namespace {

constexpr int kLast = kBrickSide - 1;

/// The place of a corner in a list.
std::optional<std::size_t> placeIn(std::span<const Coord> corners, Coord corner) {
  const auto at = std::lower_bound(corners.begin(), corners.end(), corner);
  if (at == corners.end() || *at != corner) return std::nullopt;
  return std::size_t(at - corners.begin());
}

BrickMask common(BrickMask a, const BrickMask& b) {
  for (std::size_t w = 0; w < a.words.size(); ++w) a.words[w] &= b.words[w];
  return a;
}

}  // namespace

BrickMask maskOf(const Box& box, Coord corner) {
  const LocalBox local = localBox(box, corner, kLast);
  BrickMask mask;
  for (int x = local.low[0]; x <= local.high[0]; ++x)
    for (int y = local.low[1]; y <= local.high[1]; ++y)
      for (int z = local.low[2]; z <= local.high[2]; ++z) mask.set(voxelOffset({x, y, z}));
  return mask;
}

BrickRegion regionIn(const RevoxeliseOptions& options, Coord corner) {
  const BrickMask inBox = maskOf(options.box, corner);
  if (!options.restrictToBricks) return {inBox, true};
  const auto place = placeIn(options.bricks, corner);
  if (!place) return {};
  if (!options.levels.empty()) return {inBox, true, &options.levels[*place]};
  if (options.masks.empty()) return {inBox, true};
  return {common(inBox, options.masks[*place]), false};
}

BrickMask settle(const VoxelRule& rule, const BrickRegion& region, std::span<float> values) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v) {
    values[v] = rule.settled(values[v]);
    if (region.isActive(rule, v, values[v]))
      mask.set(v);
    else
      values[v] = rule.inactiveValue(values[v]);
  }
  return mask;
}

}  // namespace esvr
