#include "render/render_cells.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include "render/picture.h"
#include "render/scene_depth.h"
#include "render/tile_ranges.h"

namespace esvr {
namespace {

Vec3 placeOf(Coord c) { return {double(c.x), double(c.y), double(c.z)}; }

/// The parameters of all rays, relative to the origin of the cells.
MarchScene sceneOf(const LazyCells& cells, const RenderOptions& o, const Picture& picture) {
  const Vec3 origin = placeOf(cells.table().origin);
  MarchScene scene{picture.view, cellsOf(cells.table()), o.step, clipOf(o),
                   sampleRule(o, picture.table.view(), cells.background())};
  scene.view.eye = difference(scene.view.eye, origin);
  scene.clip.box = {difference(scene.clip.box.low, origin),
                    difference(scene.clip.box.high, origin)};
  return scene;
}

class CellPicture {
 public:
  CellPicture(const LazyCells& cells, const RenderOptions& options, Picture& picture)
      : cells_(cells),
        scene_(sceneOf(cells, options, picture)),
        view_{scene_.view, options.resolution, options.step, firstSample(options.step)},
        ranges_(view_, cells.table().bricks),
        picture_(picture) {}

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
  [[nodiscard]] double firstSample(double step) const {
    const BinRange bins = binsWithin(scene_.box, scene_.view, step);
    checkRayLength(bins);
    return double(bins.first) * kBinSamples;
  }
  [[nodiscard]] PixelColor pixel(int column, int row, const TileSamples& range) const {
    const MarchSamples samples = samplesOf(
        scene_, column, row, {view_.firstSample + range.first, view_.firstSample + range.last});
    RayProgress ray;
    AllBricksAreThere visitor;
    (void)marchBricks(cells_.table().view(), LazySlots{cells_}, scene_, samples, ray, visitor);
    return scene_.rule.finished(ray.ray);
  }

  const LazyCells& cells_;
  MarchScene scene_;
  CoverView view_;
  TileRanges ranges_;
  Picture& picture_;
};

}  // namespace

Image renderCells(const LazyCells& cells, const RenderOptions& options) {
  Picture picture(options);
  if (cells.table().bricks.empty()) return picture.take();
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
