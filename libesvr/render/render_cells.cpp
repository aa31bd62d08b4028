#include "render/render_cells.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include "render/picture.h"
#include "render/scene_depth.h"

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

PixelColor pixelOf(const LazyCells& cells, const MarchScene& scene, int column, int row) {
  RayProgress ray;
  AllBricksAreThere visitor;
  (void)marchBricks(cells.table().view(), LazySlots{cells}, scene,
                    samplesOf(scene, column, row, SampleRange::all()), ray, visitor);
  return scene.rule.finished(ray.ray);
}

}  // namespace

Image renderCells(const LazyCells& cells, const RenderOptions& options) {
  constexpr int kTile = 16;  // pixels; neighbouring rays read the same bricks
  Picture picture(options);
  if (cells.table().bricks.empty()) return picture.take();
  const MarchScene scene = sceneOf(cells, options, picture);
  checkRayLength(binsWithin(scene.box, scene.view, options.step));
  const Resolution r = options.resolution;
  tbb::parallel_for(tbb::blocked_range2d<int>(0, r.height, kTile, 0, r.width, kTile),
                    [&](const tbb::blocked_range2d<int>& tile) {
                      checkCancelled(options);
                      for (int row = tile.rows().begin(); row != tile.rows().end(); ++row)
                        for (int column = tile.cols().begin(); column != tile.cols().end();
                             ++column)
                          picture.set(column, row, pixelOf(cells, scene, column, row));
                    });
  return picture.take();
}

}  // namespace esvr
