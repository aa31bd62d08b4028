#include "render/grids_scene.h"

#include <algorithm>
#include <limits>
#include <string>

#include "esvr/error.h"
#include "render/level_of_detail.h"
#include "render/picture.h"
#include "render/scene_depth.h"

namespace esvr {
namespace {

bool isEmpty(const PlaceBox& box) { return !(box.low[0] < box.high[0]); }

}  // namespace

PlaceBox boxAround(const std::vector<GridTable>& grids) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  PlaceBox box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const GridTable& grid : grids) {
    if (isEmpty(grid.box)) continue;
    const Vec3 origin = pointOf(grid.table.origin);
    for (int a = 0; a < 3; ++a) {
      box.low[a] = std::min(box.low[a], grid.box.low[a] + origin[a]);
      box.high[a] = std::max(box.high[a], grid.box.high[a] + origin[a]);
    }
  }
  return box;
}

namespace {

/// The origin of the first grid that has cells.
Coord originOf(const std::vector<GridTable>& grids) {
  return std::ranges::find_if(grids, [](const GridTable& g) { return !isEmpty(g.box); })
      ->table.origin;
}

}  // namespace

void checkGridsOptions(const RenderOptions& options, std::size_t grids) {
  checkRenderOptions(options, grids);
  if (options.mode != RenderMode::kComposite)
    throw UsageError("several grids in one picture can only be composited");
  if (options.shading) throw UsageError("several grids in one picture cannot be shaded");
}

GridLook lookOf(const RenderOptions& options, std::size_t grid) {
  return grid == 0 ? GridLook{options.transfer} : options.further[grid - 1];
}

GridsScene gridsScene(const RenderOptions& options, const std::vector<GridTable>& grids) {
  const Coord origin = originOf(grids);
  const Vec3 from = pointOf(origin);
  const PlaceBox box = boxAround(grids);
  GridsScene scene{
      sceneOfLevel(marchScene(options, viewOf(options, box), sampleRule(options, {}, 0.0f)),
                   LevelFrame{0}, origin),
      {}};
  scene.scene.box = {difference(box.low, from), difference(box.high, from)};
  for (std::size_t g = 0; g < grids.size(); ++g)
    scene.grids[g] = {grids[g].table, grids[g].transfer, grids[g].background,
                      lookOf(options, g).absorbs,
                      floatPlace(difference(from, pointOf(grids[g].table.origin)))};
  return scene;
}

double firstSampleOf(const GridsScene& scene) {
  const BinRange bins = binsWithin(scene.scene.box, scene.scene.view, scene.scene.step);
  checkRayLength(bins);
  return double(bins.first) * kBinSamples;
}

CoverView coverViewOf(const GridsScene& scene, std::size_t grid, Resolution resolution) {
  const FloatPlace to = scene.grids[grid].toTable;
  CoverView cover{scene.scene.view, resolution, scene.scene.step, firstSampleOf(scene)};
  cover.view.eye = sum(cover.view.eye, {double(to.x), double(to.y), double(to.z)});
  return cover;
}

}  // namespace esvr
