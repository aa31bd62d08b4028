#include "fit/paper/subvolumes.h"

#include <algorithm>

#include "core/brick_index.h"

namespace esvr::paper {
namespace {

Coord sides(const Box& box) { return box.max - box.min + Coord{1, 1, 1}; }

int bricksAcross(int voxels) { return std::max(1, (voxels + kBrickSide - 1) / kBrickSide); }

std::unique_ptr<Subvolume> emptySubvolume(const FitTarget& whole, const Box& bricks) {
  auto part = std::make_unique<Subvolume>();
  FitTarget& t = part->target;
  t.scale = whole.scale;
  t.box = whole.box;
  t.boxVoxels = bricks.volume() * kBrickVoxels;
  t.peak = whole.peak;
  t.lowest = whole.lowest;
  t.highest = whole.highest;
  t.within = bricks;
  t.active = &part->active;
  return part;
}

void addBrick(Subvolume& part, const FitTarget& whole, std::size_t b) {
  const auto* values = whole.values.data() + b * kBrickVoxels;
  part.target.bricks.push_back(whole.bricks[b]);
  part.target.values.insert(part.target.values.end(), values, values + kBrickVoxels);
  part.active.push_back((*whole.active)[b]);
  part.target.activeVoxels += std::uint64_t(part.active.back().count());
}

}  // namespace

int Space::longestAxis() const {
  const Coord s = sides(bricks);
  return std::max({s.x, s.y, s.z}) * kBrickSide;
}

int Space::shortestAxis() const {
  const Coord s = sides(bricks);
  return std::min({s.x, s.y, s.z}) * kBrickSide;
}

Box Space::voxels() const {
  return {bricks.min * kBrickSide, (bricks.max + Coord{1, 1, 1}) * kBrickSide - Coord{1, 1, 1}};
}

Space spaceOf(const FitTarget& target) {
  Space space;
  if (!target.box.empty()) space.bricks = {brickOf(target.box.min), brickOf(target.box.max)};
  for (const Coord brick : target.bricks) space.bricks.expand(brick);
  return space;
}

int subvolumeSide(const Space& space, int asked) {
  const int side = asked > 0 ? asked : std::min(space.longestAxis() / 2, space.shortestAxis());
  return bricksAcross(side) * kBrickSide;
}

std::vector<std::unique_ptr<Subvolume>> cutSubvolumes(const FitTarget& target, const Space& space,
                                                      int side) {
  const int step = bricksAcross(side);
  const Coord first = space.bricks.min;
  const auto parts = [&](int bricks) { return (bricks + step - 1) / step; };
  const Coord all = sides(space.bricks);
  const Coord count{parts(all.x), parts(all.y), parts(all.z)};
  std::vector<std::unique_ptr<Subvolume>> result;
  for (int x = 0; x < count.x; ++x)
    for (int y = 0; y < count.y; ++y)
      for (int z = 0; z < count.z; ++z) {
        const Coord low = first + Coord{x, y, z} * step;
        const Coord high = minCoord(low + Coord{step - 1, step - 1, step - 1}, space.bricks.max);
        result.push_back(emptySubvolume(target, {low, high}));
      }
  for (std::size_t b = 0; b < target.bricks.size(); ++b) {
    const Coord place = target.bricks[b] - first;
    const int n = (place.x / step * count.y + place.y / step) * count.z + place.z / step;
    addBrick(*result[std::size_t(n)], target, b);
  }
  return result;
}

}  // namespace esvr::paper
