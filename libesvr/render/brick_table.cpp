#include "render/brick_table.h"

#include <tbb/parallel_sort.h>

#include <tuple>

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

int offsetInBlock(Coord brick) {
  return int(
      offsetIn({kBlockBricks, kBlockBricks, kBlockBricks}, brick - blockOf(brick) * kBlockBricks));
}

/// The order of numbers: by block, then by place within the block.
bool before(Coord a, Coord b) {
  return std::make_tuple(blockOf(a), offsetInBlock(a)) <
         std::make_tuple(blockOf(b), offsetInBlock(b));
}

/// The rows of a block, which are made when its first brick is met.
BrickRow* rowsOf(BrickTable& table, Coord block) {
  std::uint32_t& number = table.blockOf[offsetIn(table.blocks, block)];
  if (number == kNoCells) {
    number = std::uint32_t(table.rows.size() / kRowsOfBlock);
    table.rows.resize(table.rows.size() + kRowsOfBlock, BrickRow{0, 0});
  }
  return &table.rows[std::size_t(number) * kRowsOfBlock];
}

void fillRows(BrickTable& table) {
  for (std::size_t i = 0; i < table.bricks.size(); ++i) {
    const Coord brick = table.bricks[i];
    const int offset = offsetInBlock(brick);
    BrickRow& row = rowsOf(table, blockOf(brick))[offset / BrickRow::kLength];
    if (row.there == 0) row.first = table.first + std::uint32_t(i);
    row.there |= std::uint64_t{1} << (offset % BrickRow::kLength);
  }
}

}  // namespace

BrickTable makeBrickTable(std::vector<Coord> bricks, std::uint32_t first) {
  BrickTable table;
  table.first = first;
  Box blocks;
  for (const Coord brick : bricks) blocks.expand(blockOf(brick));
  if (bricks.empty()) return table;
  if (blocks.volume() > kMaxBlocks)
    throw UsageError("the voxels lie too far apart to be drawn from bricks");
  for (Coord& brick : bricks) brick = brick - blocks.min * kBlockBricks;
  tbb::parallel_sort(bricks, before);
  table.bricks = std::move(bricks);
  table.origin = blocks.min * kBlockSide;
  table.blocks = blocks.max - blocks.min + Coord{1, 1, 1};
  table.blockOf.assign(std::size_t(blocks.volume()), kNoCells);
  fillRows(table);
  return table;
}

std::vector<Coord> placesOf(const BrickTable& table) {
  std::vector<Coord> places;
  places.reserve(table.bricks.size());
  for (std::size_t i = 0; i < table.bricks.size(); ++i) places.push_back(table.place(i));
  return places;
}

PlaceBox cellsOf(const BrickTable& table) {
  Box box;
  for (const Coord brick : table.bricks) box.expand(brick);
  if (box.empty()) return {{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}};
  const Coord low = box.min * kBrickSide, high = (box.max + Coord{1, 1, 1}) * kBrickSide;
  return {pointOf(low), pointOf(high)};
}

}  // namespace esvr
