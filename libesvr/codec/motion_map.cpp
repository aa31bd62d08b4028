#include "codec/motion_map.h"

#include <unordered_set>

namespace esvr::codec {
namespace {

constexpr std::size_t kEllipsoidsPerCube = 2;
constexpr int kSmallestSide = 23, kLargestSide = 43;  // log2, from one cell to the whole lattice

}  // namespace

MotionMap::MotionMap(std::span<const Vector64> places) {
  for (sideLog2_ = kSmallestSide; sideLog2_ < kLargestSide; ++sideLog2_) {
    std::unordered_set<Coord, Hash> cubes;
    for (const Vector64& place : places) cubes.insert(cubeOf(place));
    if (cubes.size() * kEllipsoidsPerCube <= places.size()) return;
  }
}

MotionSum MotionMap::around(const Vector64& place) const {
  const Coord middle = cubeOf(place);
  MotionSum sum;
  for (std::int32_t x = -1; x <= 1; ++x)
    for (std::int32_t y = -1; y <= 1; ++y)
      for (std::int32_t z = -1; z <= 1; ++z)
        if (const auto cube = cubes_.find(middle + Coord{x, y, z}); cube != cubes_.end())
          sum.add(cube->second);
  return sum;
}

Coord MotionMap::cubeOf(const Vector64& place) const {
  return {std::int32_t(place[0] >> sideLog2_), std::int32_t(place[1] >> sideLog2_),
          std::int32_t(place[2] >> sideLog2_)};
}

}  // namespace esvr::codec
