#include "render/render_cells.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include "render/level_march.h"
#include "render/level_tables.h"
#include "render/scene_depth.h"
#include "render/tile_ranges.h"

namespace esvr {
namespace {

Vec3 placeOf(Coord c) { return {double(c.x), double(c.y), double(c.z)}; }

/// A box that contains all cells, in index space.
PlaceBox boxOf(const BrickTable& table) {
  const PlaceBox cells = cellsOf(table);
  const Vec3 origin = placeOf(table.origin);
  return {sum(cells.low, origin), sum(cells.high, origin)};
}

LevelScene sceneOf(LazyCells& cells, const RenderOptions& o, const Picture& picture) {
  const SampleRule rule = sampleRule(o, picture.table.view(), cells.background());
  LevelScene scene{marchScene(o, rule), levelBounds(o, picture.view, boxOf(cells.table(0))), {}};
  cells.prepare(scene.bounds.last);
  return scene;
}

class CellPicture {
 public:
  CellPicture(LazyCells& cells, const RenderOptions& options, Picture& picture)
      : cells_(cells),
        scene_(sceneOf(cells, options, picture)),
        tables_(picture, options, scene_.bounds),
        last_{scene_.bounds.last},
        view_{viewOfLast(), options.resolution, options.step, firstSample()},
        ranges_(view_, lastTable().bricks),
        picture_(picture) {
    for (int level = scene_.bounds.first; level <= scene_.bounds.last; ++level)
      scene_.levels[level - scene_.bounds.first] = {
          cells.table(level).view(), cellsOf(cells.table(level)), tables_.view(level)};
  }

  [[nodiscard]] const TileRanges& tiles() const { return ranges_; }

  void drawTile(int tileColumn, int tileRow) const {
    const TileSamples range = ranges_.at(tileColumn, tileRow);
    if (range.last < range.first) return;
    constexpr int kSide = TileRanges::kSide;
    const int pastColumn = std::min((tileColumn + 1) * kSide, view_.resolution.width);
    const int pastRow = std::min((tileRow + 1) * kSide, view_.resolution.height);
    for (int row = tileRow * kSide; row < pastRow; ++row)
      for (int column = tileColumn * kSide; column < pastColumn; ++column)
        picture_.set(column, row, pixel(column, row, range));
  }

 private:
  [[nodiscard]] const BrickTable& lastTable() const { return cells_.table(last_.level); }
  /// Tiles find their ranges among the bricks of the coarsest level, which are the fewest.
  [[nodiscard]] View viewOfLast() const {
    return sceneOfLevel(scene_.scene, last_, lastTable().origin).view;
  }
  [[nodiscard]] double firstSample() const {
    const BinRange bins = binsWithin(cellsOf(lastTable()), viewOfLast(), scene_.scene.step);
    checkRayLength(bins);
    return double(bins.first) * kBinSamples;
  }
  [[nodiscard]] PixelColor pixel(int column, int row, const TileSamples& range) const {
    const SampleRange wanted{(view_.firstSample + range.first) * last_.side(),
                             (view_.firstSample + range.last) * last_.side()};
    RayProgress ray;
    AllBricksAreThere visitor;
    const LazySlots slots{cells_};
    if (scene_.scene.isShaded)
      (void)marchLevels<MarchCode{.isShaded = true}>(scene_, slots, column, row, wanted, ray,
                                                     visitor);
    else
      (void)marchLevels<MarchCode{}>(scene_, slots, column, row, wanted, ray, visitor);
    return finished(scene_, ray);
  }

  const LazyCells& cells_;
  LevelScene scene_;
  LevelTables tables_;
  LevelFrame last_;
  CoverView view_;
  TileRanges ranges_;
  Picture& picture_;
};

}  // namespace

Image renderCells(LazyCells& cells, const RenderOptions& options) {
  Picture picture(options);
  if (cells.table(0).bricks.empty()) return picture.take();
  const CellPicture drawing(cells, options, picture);
  using Tiles = tbb::blocked_range2d<int>;
  tbb::parallel_for(
      Tiles(0, drawing.tiles().rows(), 0, drawing.tiles().columns()), [&](const Tiles& tiles) {
        checkCancelled(options);
        for (int row = tiles.rows().begin(); row != tiles.rows().end(); ++row)
          for (int column = tiles.cols().begin(); column != tiles.cols().end(); ++column)
            drawing.drawTile(column, row);
      });
  return picture.take();
}

}  // namespace esvr
