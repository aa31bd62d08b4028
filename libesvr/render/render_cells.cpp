#include "render/render_cells.h"

#include "render/draw_tiles.h"
#include "render/level_march.h"
#include "render/level_tables.h"
#include "render/scene_depth.h"

namespace esvr {
namespace {

/// A box that contains all cells, in index space.
PlaceBox cellBoxOf(const BrickTable& table) {
  const PlaceBox cells = cellsOf(table);
  const Vec3 origin = pointOf(table.origin);
  return {sum(cells.low, origin), sum(cells.high, origin)};
}

LevelScene sceneOf(LazyCells& cells, const RenderOptions& o, const Picture& picture) {
  const SampleRule rule = sampleRule(o, picture.table.view(), cells.background());
  LevelScene scene{marchScene(o, picture.view, rule),
                   levelBounds(o, picture.view, cellBoxOf(cells.table(0))),
                   {}};
  cells.prepare(scene.bounds.last);
  return scene;
}

class CellPicture {
 public:
  CellPicture(LazyCells& cells, const RenderOptions& options, const Picture& picture)
      : cells_(cells),
        scene_(sceneOf(cells, options, picture)),
        tables_(picture, options, scene_.bounds),
        last_{scene_.bounds.last},
        view_{viewOfLast(), options.resolution, options.step, firstSample()},
        ranges_(options.resolution) {
    ranges_.add(view_, lastTable().bricks);
    for (int level = scene_.bounds.first; level <= scene_.bounds.last; ++level)
      scene_.levels[level - scene_.bounds.first] = {
          cells.table(level).view(), cellsOf(cells.table(level)), tables_.view(level)};
  }

  [[nodiscard]] const TileRanges& tiles() const { return ranges_; }

  /// The color of a pixel.
  [[nodiscard]] PixelColor operator()(int column, int row, const TileSamples& range) const {
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

  const LazyCells& cells_;
  LevelScene scene_;
  LevelTables tables_;
  LevelFrame last_;
  CoverView view_;
  TileRanges ranges_;
};

}  // namespace

Image renderCells(LazyCells& cells, const RenderOptions& options) {
  Picture picture(options, cellBoxOf(cells.table(0)));
  if (cells.table(0).bricks.empty()) return picture.take();
  const CellPicture colorOf(cells, options, picture);
  drawTiles(options, colorOf.tiles(), picture, colorOf);
  return picture.take();
}

}  // namespace esvr
