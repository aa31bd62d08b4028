#include "render/brick_atlas.h"

#include <tbb/parallel_for.h>

#include <array>

#include "core/brick_index.h"
#include "core/cell_corner.h"
#include "esvr/error.h"
#include "render/cell_bricks.h"

namespace esvr {
namespace {

constexpr double kMaxBlocks = double(1 << 28);  // 1 GB

/// The values of a brick and of its upper neighbours by the number of the corner; null: no brick.
using CornerBricks = std::array<const float*, kCellCorners>;

class CellReader {
 public:
  explicit CellReader(const SparseVolume& volume) : volume_(volume), index_(volume.bricks) {}

  /// Reads the voxels at the corners of a brick's cells. \return false if all are the background
  bool read(Coord brick, float* values) const {
    CornerBricks from{};
    for (int c = 0; c < kCellCorners; ++c) from[c] = find(brick + stepToCorner(c));
    bool any = false;
    for (int x = 0; x < kCellBrickSide; ++x)
      for (int y = 0; y < kCellBrickSide; ++y)
        for (int z = 0; z < kCellBrickSide; ++z) {
          const float v = value(from, {x, y, z});
          any |= v != volume_.background;
          *values++ = v;
        }
    return any;
  }

 private:
  [[nodiscard]] const float* find(Coord brick) const {
    const std::uint32_t at = index_.find(brick);
    return at == BrickIndex::kNone ? nullptr : volume_.brickValues(at).data();
  }
  [[nodiscard]] float value(const CornerBricks& from, Coord at) const {
    const float* values = from[cornerAt(brickOf(at))];
    return values == nullptr ? volume_.background : values[voxelOffset(localOf(at))];
  }

  const SparseVolume& volume_;
  const BrickIndex index_;
};

/// The candidates that have a voxel other than the background.
std::vector<Coord> occupied(const CellReader& reader, const std::vector<Coord>& all) {
  std::vector<char> any(all.size());
  tbb::parallel_for(std::size_t(0), all.size(), [&](std::size_t i) {
    std::array<float, kCellBrickVoxels> values;
    any[i] = reader.read(all[i], values.data()) ? 1 : 0;
  });
  std::vector<Coord> bricks;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (any[i] != 0) bricks.push_back(all[i]);
  return bricks;
}

/// The block of a brick. The shift rounds down, also below zero.
Coord blockOf(Coord brick) {
  static_assert(kBlockBricks == 8);
  return {brick.x >> 3, brick.y >> 3, brick.z >> 3};
}

std::size_t offsetIn(Coord size, Coord at) {
  return (std::size_t(at.x) * std::size_t(size.y) + std::size_t(at.y)) * std::size_t(size.z) +
         std::size_t(at.z);
}

/// Numbers blocks and bricks in the order of the bricks.
void index(BrickAtlas& atlas) {
  const Coord bricks{kBlockBricks, kBlockBricks, kBlockBricks};
  const double blocks = double(atlas.blocks.x) * atlas.blocks.y * atlas.blocks.z;
  if (blocks > kMaxBlocks) throw UsageError("the voxels lie too far apart to be drawn from bricks");
  atlas.blockOf.assign(std::size_t(blocks), kNoCells);
  for (std::uint32_t i = 0; i < atlas.bricks.size(); ++i) {
    const Coord block = blockOf(atlas.bricks[i]);
    std::uint32_t& number = atlas.blockOf[offsetIn(atlas.blocks, block)];
    if (number == kNoCells) {
      number = std::uint32_t(atlas.brickOf.size() / kBricksOfBlock);
      atlas.brickOf.resize(atlas.brickOf.size() + kBricksOfBlock, kNoCells);
    }
    const Coord within = atlas.bricks[i] - block * kBlockBricks;
    atlas.brickOf[std::size_t(number) * kBricksOfBlock + offsetIn(bricks, within)] = i;
  }
}

}  // namespace

BrickAtlas makeBrickAtlas(const SparseVolume& volume) {
  const CellReader reader(volume);
  BrickAtlas atlas;
  atlas.bricks = occupied(reader, bricksWithCells(volume));
  Box blocks;
  for (const Coord brick : atlas.bricks) blocks.expand(blockOf(brick));
  if (atlas.bricks.empty()) return atlas;
  atlas.values.resize(atlas.bricks.size() * kCellBrickVoxels);
  tbb::parallel_for(std::size_t(0), atlas.bricks.size(), [&](std::size_t i) {
    (void)reader.read(atlas.bricks[i], &atlas.values[i * kCellBrickVoxels]);
  });
  for (Coord& brick : atlas.bricks) brick = brick - blocks.min * kBlockBricks;
  atlas.origin = volume.origin + blocks.min * kBlockSide;
  atlas.blocks = blocks.max - blocks.min + Coord{1, 1, 1};
  index(atlas);
  return atlas;
}

PlaceBox cellsOf(const BrickAtlas& atlas) {
  Box box;
  for (const Coord brick : atlas.bricks) box.expand(brick);
  if (box.empty()) return {{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}};
  const Coord low = box.min * kBrickSide, high = (box.max + Coord{1, 1, 1}) * kBrickSide;
  return {{double(low.x), double(low.y), double(low.z)},
          {double(high.x), double(high.y), double(high.z)}};
}

}  // namespace esvr
