#pragma once
/// Draws the tiles of a picture in parallel on the CPU.

#include <tbb/blocked_range2d.h>

#include <algorithm>

#include "core/parallel.h"
#include "render/picture.h"
#include "render/tile_ranges.h"

namespace esvr {

/// Sets the pixels of the tiles whose rays may meet bricks.
/// \param colorOf  colorOf(column, row, samples) returns the color of a pixel; `samples` are those of
///                 its tile
/// \throws Cancelled  RenderOptions::cancel was set
template <class ColorOf>
void drawTiles(const RenderOptions& options, const TileRanges& ranges, Picture& picture,
               const ColorOf& colorOf) {
  const auto drawTile = [&](int tileColumn, int tileRow) {
    const TileSamples samples = ranges.at(tileColumn, tileRow);
    if (samples.last < samples.first) return;
    constexpr int kSide = TileRanges::kSide;
    const int pastColumn = std::min((tileColumn + 1) * kSide, options.resolution.width);
    const int pastRow = std::min((tileRow + 1) * kSide, options.resolution.height);
    for (int row = tileRow * kSide; row < pastRow; ++row)
      for (int column = tileColumn * kSide; column < pastColumn; ++column) {
        checkCancelled(options);  // a single ray may take a tenth of a second
        picture.set(column, row, colorOf(column, row, samples));
      }
  };
  using Tiles = tbb::blocked_range2d<int>;
  parallelFor(Tiles(0, ranges.rows(), 0, ranges.columns()), [&](const Tiles& tiles) {
    for (int row = tiles.rows().begin(); row != tiles.rows().end(); ++row)
      for (int column = tiles.cols().begin(); column != tiles.cols().end(); ++column)
        drawTile(column, row);
  });
}

}  // namespace esvr
