#pragma once
/// Marches a ray through bricks of cells. A brick holds all voxels at the corners of its cells, so
/// that the interpolation of a sample reads one brick only. A ray crosses an empty brick, or an
/// empty block of bricks, in one step. The code is compiled for host and device.

#include <cstdint>

#include "render/march_scene.h"

namespace esvr {

/// A brick has 8 x 8 x 8 cells and stores the 9 x 9 x 9 voxels at their corners, z fastest.
inline constexpr int kCellBrickSide = kBrickSide + 1;
inline constexpr int kCellBrickVoxels = kCellBrickSide * kCellBrickSide * kCellBrickSide;
/// A brick is found through its block, which has 8 x 8 x 8 bricks.
inline constexpr int kBlockBricks = 8;
inline constexpr int kBlockSide = kBlockBricks * kBrickSide;  ///< voxels
inline constexpr int kBricksOfBlock = kBlockBricks * kBlockBricks * kBlockBricks;
inline constexpr std::uint32_t kNoCells = 0xffffffffu;

/// Pointers to a brick atlas in host or device memory.
struct BrickAtlasView {
  Coord origin;                  ///< first voxel of the first block
  Coord blocks;                  ///< number of blocks along each axis
  const std::uint32_t* blockOf;  ///< number of each block, or kNoCells; z fastest
  const std::uint32_t* brickOf;  ///< by block: number of each brick, or kNoCells; z fastest
  const float* values;           ///< kCellBrickVoxels for each brick
};

namespace brick_march {

/// The brick that has a cell, or the empty cube around the cell: a brick or a whole block.
struct Found {
  std::uint32_t brick;  ///< kNoCells: empty
  Coord low;            ///< lowest corner of the brick or cube
  int side;
};

/// \param v  cell relative to the atlas; it must lie within the blocks
ESVR_HD inline Found find(const BrickAtlasView& a, const Coord& v) {
  const Coord block{v.x / kBlockSide, v.y / kBlockSide, v.z / kBlockSide};
  const std::uint32_t number =
      a.blockOf[(std::size_t(block.x) * a.blocks.y + block.y) * a.blocks.z + block.z];
  if (number == kNoCells)
    return {
        kNoCells, {block.x * kBlockSide, block.y * kBlockSide, block.z * kBlockSide}, kBlockSide};
  const Coord brick{v.x >> kBrickLog2, v.y >> kBrickLog2, v.z >> kBrickLog2};
  constexpr int kMask = kBlockBricks - 1;
  const int inBlock =
      ((brick.x & kMask) * kBlockBricks + (brick.y & kMask)) * kBlockBricks + (brick.z & kMask);
  return {a.brickOf[std::size_t(number) * kBricksOfBlock + inBlock],
          {brick.x << kBrickLog2, brick.y << kBrickLog2, brick.z << kBrickLog2},
          kBrickSide};
}

ESVR_HD inline float between(float a, float b, float s) { return a + s * (b - a); }

/// \param values  voxels of the brick
ESVR_HD inline float interpolate(const float* values, const FloatPlace& p, const Coord& cell) {
  constexpr int kMask = kBrickSide - 1, kX = kCellBrickSide * kCellBrickSide, kY = kCellBrickSide;
  const float* v = values + (cell.x & kMask) * kX + (cell.y & kMask) * kY + (cell.z & kMask);
  const float x = p.x - float(cell.x), y = p.y - float(cell.y), z = p.z - float(cell.z);
  const float low = between(between(v[0], v[1], z), between(v[kY], v[kY + 1], z), y);
  const float high =
      between(between(v[kX], v[kX + 1], z), between(v[kX + kY], v[kX + kY + 1], z), y);
  return between(low, high, x);
}

ESVR_HD inline Coord cellOf(const FloatPlace& p) {
  return {int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z))};
}

ESVR_HD inline bool inside(const BrickAtlasView& a, const Coord& v) {
  return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < a.blocks.x * kBlockSide &&
         v.y < a.blocks.y * kBlockSide && v.z < a.blocks.z * kBlockSide;
}

}  // namespace brick_march

/// \param scene  its box and view are relative to the atlas' origin
ESVR_HD inline PixelColor marchBricks(const BrickAtlasView& atlas, const MarchScene& scene,
                                      int column, int row, const SampleRange& wanted) {
  using namespace brick_march;
  const MarchSamples samples = samplesOf(scene, column, row, wanted);
  RayState ray;
  Found found{kNoCells, {0, 0, 0}, 0};
  for (int i = 0; i < samples.count && scene.rule.open(ray);) {
    const FloatPlace place = samples.at(i);
    const Coord cell = cellOf(place);
    if (!inside(atlas, cell)) {  // rounding can move a place beyond the box
      ++i;
      continue;
    }
    const Coord past{cell.x - found.low.x, cell.y - found.low.y, cell.z - found.low.z};
    const bool same = past.x >= 0 && past.y >= 0 && past.z >= 0 && past.x < found.side &&
                      past.y < found.side && past.z < found.side;
    if (!same) found = find(atlas, cell);
    if (found.brick == kNoCells) {
      i += march::samplesToLeave(place, samples.apart, found.low, found.side);
      continue;
    }
    const float value =
        interpolate(atlas.values + std::size_t(found.brick) * kCellBrickVoxels, place, cell);
    if (value != scene.rule.background) scene.rule.add(ray, value, samples.numberOf(i));
    ++i;
  }
  return scene.rule.finished(ray);
}

}  // namespace esvr
