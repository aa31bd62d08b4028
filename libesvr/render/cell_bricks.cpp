#include "render/cell_bricks.h"

#include <algorithm>
#include <iterator>
#include <tuple>

#include "core/brick_index.h"
#include "core/parallel.h"
#include "esvr/error.h"

namespace esvr {

// Places of bricks.

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
  // The bricks and those one step below along each axis. Increasing order is kept, because a shift
  // does not change it.
  std::vector<Coord> bricks(voxels.begin(), voxels.end());
  for (const Coord step : {Coord{0, 0, 1}, Coord{0, 1, 0}, Coord{1, 0, 0}}) {
    std::vector<Coord> below(bricks), all;
    for (Coord& brick : below) brick = brick - step;
    all.reserve(bricks.size() + bricks.size() / 2);
    std::ranges::set_union(bricks, below, std::back_inserter(all));
    bricks = std::move(all);
  }
  return bricks;
}

// Numbers of bricks.

namespace {

constexpr double kMaxBlocks = double(1 << 28);  // 1 GB

/// The block of a brick. The shift rounds down, also below zero.
Coord blockOf(Coord brick) {
  static_assert(kBlockBricks == 8);
  return {brick.x >> 3, brick.y >> 3, brick.z >> 3};
}

int offsetInBlock(Coord brick) {
  const Coord at = brick - blockOf(brick) * kBlockBricks;
  return (at.x * kBlockBricks + at.y) * kBlockBricks + at.z;
}

}  // namespace

BrickTable makeBrickTable(std::vector<Coord> bricks, std::uint32_t first) {
  BrickTable table;
  table.first = first;
  Box blocks;
  for (const Coord brick : bricks) blocks.expand(blockOf(brick));
  if (bricks.empty()) return table;
  if (blocks.volume() > kMaxBlocks)
    throw UsageError(
        "the voxels lie too far apart to be drawn from bricks; a grid by itself can be drawn on "
        "the CPU");
  for (Coord& brick : bricks) brick = brick - blocks.min * kBlockBricks;
  tbb::parallel_sort(bricks, [](Coord a, Coord b) {
    return std::make_tuple(blockOf(a), offsetInBlock(a)) <
           std::make_tuple(blockOf(b), offsetInBlock(b));
  });
  table.bricks = std::move(bricks);
  table.origin = blocks.min * kBlockSide;
  table.blocks = blocks.max - blocks.min + Coord{1, 1, 1};
  table.blockOf.assign(std::size_t(blocks.volume()), kNoCells);
  for (std::size_t i = 0; i < table.bricks.size(); ++i) {
    const Coord brick = table.bricks[i], block = blockOf(brick);
    std::uint32_t& number =
        table.blockOf[(std::size_t(block.x) * std::size_t(table.blocks.y) + std::size_t(block.y)) *
                          std::size_t(table.blocks.z) +
                      std::size_t(block.z)];
    if (number == kNoCells) {  // the first brick of its block
      number = std::uint32_t(table.rows.size() / kRowsOfBlock);
      table.rows.resize(table.rows.size() + kRowsOfBlock, BrickRow{0, 0});
    }
    const int offset = offsetInBlock(brick);
    BrickRow& row =
        table.rows[std::size_t(number) * kRowsOfBlock + std::size_t(offset / BrickRow::kLength)];
    if (row.there == 0) row.first = first + std::uint32_t(i);
    row.there |= std::uint64_t{1} << (offset % BrickRow::kLength);
  }
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
  if (box.empty()) return kNoPlaces;
  const Coord low = box.min * kBrickSide, high = (box.max + Coord{1, 1, 1}) * kBrickSide;
  return {pointOf(low), pointOf(high)};
}

// Voxels of bricks.

bool fillCells(const CornerBricks& from, float background,
               std::span<float, kCellBrickVoxels> cells) {
  if (std::ranges::all_of(from, [](const float* brick) { return brick == nullptr; })) return false;
  std::ranges::fill(cells, background);
  for (int c = 0; c < kCellCorners; ++c) {
    if (from[c] == nullptr) continue;
    // The part of the cells whose voxels lie in this brick of voxels.
    const Coord corner = stepToCorner(c);
    const auto last = [](int step) { return step == 0 ? kBrickSide : 1; };
    for (int x = 0; x < last(corner.x); ++x)
      for (int y = 0; y < last(corner.y); ++y) {
        const float* const row = from[c] + voxelOffset({x, y, 0});
        const Coord to{x + corner.x * kBrickSide, y + corner.y * kBrickSide, corner.z * kBrickSide};
        std::copy_n(row, last(corner.z),
                    &cells[std::size_t((to.x * kCellBrickSide + to.y) * kCellBrickSide + to.z)]);
      }
  }
  return std::ranges::any_of(cells, [&](float v) { return v != background; });
}

namespace {

/// The places of the bricks of a volume, not relative to its origin.
std::vector<Coord> placesOf(const SparseVolume& volume) {
  std::vector<Coord> places(volume.bricks);
  for (Coord& place : places) place = place + brickOf(volume.origin);
  return places;
}

}  // namespace

std::vector<const float*> BrickAtlas::pages() const {
  std::vector<const float*> pages;
  for (std::size_t first = 0; first < values.size(); first += BrickSlotsView::kPageFloats)
    pages.push_back(values.data() + first);
  return pages;
}

BrickAtlas makeBrickAtlas(const SparseVolume& volume, std::uint32_t first) {
  const BrickIndex index(volume.bricks);
  const Coord origin = brickOf(volume.origin);
  const auto find = [&](Coord place) -> const float* {
    const std::uint32_t at = index.find(place - origin);
    return at == BrickIndex::kNone ? nullptr : volume.brickValues(at).data();
  };
  const auto read = [&](Coord place, std::span<float, kCellBrickVoxels> values) {
    return fillCells(cornerBricks(place, find), volume.background, values);
  };

  const std::vector<Coord> all = bricksWithCells(placesOf(volume));
  std::vector<char> any(all.size());
  parallelFor(std::size_t(0), all.size(), [&](std::size_t i) {
    std::array<float, kCellBrickVoxels> values;
    any[i] = read(all[i], values) ? 1 : 0;
  });
  std::vector<Coord> occupied;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (any[i] != 0) occupied.push_back(all[i]);

  BrickAtlas atlas{makeBrickTable(std::move(occupied), first), {}};
  const std::size_t count = atlas.table.bricks.size();
  atlas.values.resize(count * kCellBrickVoxels);
  parallelFor(std::size_t(0), count, [&](std::size_t i) {
    (void)read(atlas.table.place(i), std::span<float, kCellBrickVoxels>(
                                         &atlas.values[i * kCellBrickVoxels], kCellBrickVoxels));
  });
  return atlas;
}

// Levels of detail.

void averageInto(std::span<const float, kBrickVoxels> voxels, int corner,
                 std::span<float, kBrickVoxels> coarser) {
  constexpr int kHalf = kBrickSide / 2;
  const Coord from = stepToCorner(corner) * kHalf;
  for (int x = 0; x < kHalf; ++x)
    for (int y = 0; y < kHalf; ++y)
      for (int z = 0; z < kHalf; ++z) {
        float eight[kCellCorners];
        for (int c = 0; c < kCellCorners; ++c)
          eight[c] = voxels[std::size_t(voxelOffset(Coord{2 * x, 2 * y, 2 * z} + stepToCorner(c)))];
        coarser[std::size_t(voxelOffset(from + Coord{x, y, z}))] = meanOf(eight);
      }
}

SparseVolume coarserVolume(const SparseVolume& volume) {
  SparseVolume coarser;
  coarser.background = volume.background;
  coarser.bricks = coarserBricks(placesOf(volume));
  Box box;
  for (const Coord brick : coarser.bricks) box.expand(brick);
  const Coord low = coarser.bricks.empty() ? Coord{} : box.min;
  const BrickIndex index(volume.bricks);
  coarser.origin = low * kBrickSide;
  coarser.values.resize(coarser.bricks.size() * kBrickVoxels);
  coarser.active.resize(coarser.bricks.size());
  parallelFor(std::size_t(0), coarser.bricks.size(), [&](std::size_t i) {
    Coord& brick = coarser.bricks[i];
    const std::span<float, kBrickVoxels> values(coarser.brickValues(i));
    std::ranges::fill(values, volume.background);
    for (int c = 0; c < kCellCorners; ++c) {
      const std::uint32_t from = index.find(brick * 2 + stepToCorner(c) - brickOf(volume.origin));
      if (from != BrickIndex::kNone)
        averageInto(std::span<const float, kBrickVoxels>(volume.brickValues(from)), c, values);
    }
    brick = brick - low;
  });
  return coarser;
}

void VolumeLevels::prepare(int last) {
  while (int(coarser_.size()) < last)
    coarser_.push_back(coarserVolume((*this)[int(coarser_.size())]));
}

}  // namespace esvr
