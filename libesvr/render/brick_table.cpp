#include "render/brick_table.h"

#include "esvr/error.h"

namespace esvr {
namespace {

constexpr double kMaxBlocks = double(1 << 28);  // 1 GB

/// The block of a brick. The shift rounds down, also below zero.
Coord blockOf(Coord brick) {
  static_assert(kBlockBricks == 8);
  return {brick.x >> 3, brick.y >> 3, brick.z >> 3};
}

std::size_t offsetIn(Coord size, Coord at) {
  return (std::size_t(at.x) * std::size_t(size.y) + std::size_t(at.y)) * std::size_t(size.z) +
         std::size_t(at.z);
}

/// Numbers the blocks in the order of their first bricks.
void fillTables(BrickTable& table) {
  const Coord bricks{kBlockBricks, kBlockBricks, kBlockBricks};
  for (std::uint32_t i = 0; i < table.bricks.size(); ++i) {
    const Coord block = blockOf(table.bricks[i]);
    std::uint32_t& number = table.blockOf[offsetIn(table.blocks, block)];
    if (number == kNoCells) {
      number = std::uint32_t(table.brickOf.size() / kBricksOfBlock);
      table.brickOf.resize(table.brickOf.size() + kBricksOfBlock, kNoCells);
    }
    const Coord within = table.bricks[i] - block * kBlockBricks;
    table.brickOf[std::size_t(number) * kBricksOfBlock + offsetIn(bricks, within)] = i;
  }
}

}  // namespace

BrickTable makeBrickTable(std::vector<Coord> bricks, Coord origin) {
  BrickTable table;
  Box blocks;
  for (const Coord brick : bricks) blocks.expand(blockOf(brick));
  if (bricks.empty()) return table;
  if (blocks.volume() > kMaxBlocks)
    throw UsageError("the voxels lie too far apart to be drawn from bricks");
  for (Coord& brick : bricks) brick = brick - blocks.min * kBlockBricks;
  table.bricks = std::move(bricks);
  table.origin = origin + blocks.min * kBlockSide;
  table.blocks = blocks.max - blocks.min + Coord{1, 1, 1};
  table.blockOf.assign(std::size_t(blocks.volume()), kNoCells);
  fillTables(table);
  return table;
}

PlaceBox cellsOf(const BrickTable& table) {
  Box box;
  for (const Coord brick : table.bricks) box.expand(brick);
  if (box.empty()) return {{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}};
  const Coord low = box.min * kBrickSide, high = (box.max + Coord{1, 1, 1}) * kBrickSide;
  return {{double(low.x), double(low.y), double(low.z)},
          {double(high.x), double(high.y), double(high.z)}};
}

}  // namespace esvr
