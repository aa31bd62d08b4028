#include "field/dilate_bricks.h"

#include <algorithm>
#include <iterator>

namespace esvr {
namespace {

using Coords = std::vector<Coord>;

Coords shifted(const Coords& bricks, Coord by) {
  Coords result(bricks);
  for (Coord& brick : result) brick = brick + by;
  return result;
}

Coords merged(const Coords& a, const Coords& b) {
  Coords result;
  result.reserve(a.size() + b.size());
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

/// Grows the set along one axis. Shifted bricks keep their order, so this is a merge of three
/// lists.
Coords grownAlong(const Coords& bricks, Coord axis) {
  return merged(merged(shifted(bricks, axis * -1), bricks), shifted(bricks, axis));
}

}  // namespace

std::vector<Coord> dilateBricks(std::span<const Coord> bricks) {
  Coords grown(bricks.begin(), bricks.end());
  for (const Coord axis : {Coord{0, 0, 1}, Coord{0, 1, 0}, Coord{1, 0, 0}})
    grown = grownAlong(grown, axis);
  return grown;
}

}  // namespace esvr
