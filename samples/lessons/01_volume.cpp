// Lesson 1: a sparse volume.
//
// A volume is a list of bricks, 8 x 8 x 8 voxels each, placed on multiples of 8. Where there is no
// brick the volume has its background value. Inside a brick every voxel has a value, and a bit says
// whether it is active: part of the object, as opposed to padding of the brick.
//
// No data structure of this library is as large as the bounding box of the object: sizes depend on
// the number of bricks.

#include <cstdio>

#include "esvr/volume.h"
#include "ring.h"

int main() {
  // Makes one brick. Its corner is given in index coordinates, the integer coordinates of the grid.
  esvr::BrickInput brick{.corner = {-8, 0, 16}, .values = {}, .active = {}};
  const esvr::Coord local{1, 2, 3};
  brick.values[std::size_t(esvr::voxelOffset(local))] = 0.5f;
  brick.active.set(esvr::voxelOffset(local));

  // Bricks may come in any order; makeVolume sorts them.
  const esvr::SparseVolume small = esvr::makeVolume({brick}, 0.0f);
  check(esvr::valueAt(small, {-7, 2, 19}) == 0.5f, "a voxel lies at corner + local");
  check(esvr::valueAt(small, {1000000, 0, 0}) == 0.0f, "a voxel outside all bricks is background");
  check(esvr::activeVoxelCount(small) == 1, "one voxel is active");

  // ring.h fills bricks from a formula in the same way. The other lessons work on this ring.
  const esvr::SparseVolume ring = makeRing();
  const esvr::Box box = esvr::activeBox(ring);
  std::printf("the ring: %zu bricks, %llu active voxels, from %s to %s\n", ring.brickCount(),
              static_cast<unsigned long long>(esvr::activeVoxelCount(ring)),
              esvr::toString(box.min).c_str(), esvr::toString(box.max).c_str());
  check(double(esvr::activeVoxelCount(ring)) < 0.5 * box.volume(), "most of its box is empty");
}
