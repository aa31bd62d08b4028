#include "render/tile_ranges.h"

#include <algorithm>
#include <limits>

namespace esvr {
namespace {

int tilesAlong(int pixels) { return (pixels + TileRanges::kSide - 1) / TileRanges::kSide; }

BrickCover both(const BrickCover& a, const BrickCover& b) {
  return {std::min(a.firstColumn, b.firstColumn),
          std::max(a.lastColumn, b.lastColumn),
          std::min(a.firstRow, b.firstRow),
          std::max(a.lastRow, b.lastRow),
          std::min(a.first, b.first),
          std::max(a.last, b.last)};
}

BrickCover coverOf(const CoverView& view, const Coord& brick) {
  BrickCover cover = coverOfCorner(view, brick, 0);
  for (int c = 1; c < kCellCorners; ++c) cover = both(cover, coverOfCorner(view, brick, c));
  if (view.view.perspective) cover.first = firstSampleOf(view, brick);
  return cover;
}

}  // namespace

TileRanges::TileRanges(Resolution resolution)
    : columns_(tilesAlong(resolution.width)),
      rows_(tilesAlong(resolution.height)),
      ranges_(std::size_t(columns_) * std::size_t(rows_),
              {std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {}

void TileRanges::add(const CoverView& view, const std::vector<Coord>& bricks) {
  for (const Coord brick : bricks) addOne(view, brick);
}

void TileRanges::addOne(const CoverView& view, const Coord& brick) {
  const BrickCover cover = coverOf(view, brick);
  const CoveredTiles tiles = tilesOf(view, cover, kSide);
  for (int row = tiles.firstRow; row < tiles.firstRow + tiles.rows; ++row)
    for (int column = tiles.firstColumn; column < tiles.firstColumn + tiles.columns; ++column) {
      TileSamples& range = ranges_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)];
      range.first = std::min(range.first, cover.first);
      range.last = std::max(range.last, cover.last);
    }
}

}  // namespace esvr
