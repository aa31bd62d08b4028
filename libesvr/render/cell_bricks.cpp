#include "render/cell_bricks.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <iterator>

#include "esvr/sparse_volume.h"

namespace esvr {
namespace {

/// The bricks and those one step below, in increasing order, which a shift does not change.
std::vector<Coord> withShifted(const std::vector<Coord>& bricks, Coord step) {
  std::vector<Coord> below(bricks), all;
  for (Coord& brick : below) brick = brick - step;
  all.reserve(bricks.size() + bricks.size() / 2);
  std::ranges::set_union(bricks, below, std::back_inserter(all));
  return all;
}

}  // namespace

std::vector<Coord> bricksAt(std::span<const Coord> corners) {
  std::vector<Coord> bricks;
  bricks.reserve(corners.size());
  for (const Coord corner : corners) bricks.push_back(brickOf(corner));
  return bricks;
}

std::vector<Coord> coarserBricks(std::span<const Coord> bricks) {
  std::vector<Coord> coarser;
  coarser.reserve(bricks.size());
  for (const Coord b : bricks) coarser.push_back({b.x >> 1, b.y >> 1, b.z >> 1});
  tbb::parallel_sort(coarser);
  coarser.erase(std::unique(coarser.begin(), coarser.end()), coarser.end());
  return coarser;
}

std::vector<Coord> bricksWithCells(std::span<const Coord> voxels) {
  std::vector<Coord> bricks(voxels.begin(), voxels.end());
  for (const Coord step : {Coord{0, 0, 1}, Coord{0, 1, 0}, Coord{1, 0, 0}})
    bricks = withShifted(bricks, step);
  return bricks;
}

}  // namespace esvr
