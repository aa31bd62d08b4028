
#include "core/parallel.h"
#include "esvr/render.h"
#include "render/picture.h"
#include "render/render_cells.h"
#include "render/scene_depth.h"
#include "render/sum_tile.h"

namespace esvr {
namespace {

using Lists = std::vector<std::vector<std::uint32_t>>;

int tilesAlong(int pixels) { return (pixels + kTileSide - 1) / kTileSide; }

/// For each tile of one row of tiles, lists the ellipsoids whose bounds overlap it, in the order of
/// the field. Only one row is listed at a time, which limits the memory of the lists.
Lists ellipsoidsOfTiles(const VisibleEllipsoids& ellipsoids, int firstRow, int tiles) {
  Lists lists(static_cast<std::size_t>(tiles));
  for (std::uint32_t p = 0; p < ellipsoids.bounds.size(); ++p) {
    const ScreenBounds& b = ellipsoids.bounds[p];
    if (b.lastRow < firstRow || b.firstRow >= firstRow + kTileSide) continue;
    for (int t = b.firstColumn / kTileSide; t <= b.lastColumn / kTileSide; ++t)
      lists[t].push_back(p);
  }
  return lists;
}

void drawRow(const TileScene& scene, int firstRow, Picture& picture) {
  const int tiles = tilesAlong(scene.options.resolution.width);
  const Lists lists = ellipsoidsOfTiles(scene.ellipsoids, firstRow, tiles);
  parallelFor(0, tiles, [&](int t) {
    if (lists[t].empty()) return;
    checkCancelled(scene.options);
    SumTile tile(scene, {t * kTileSide, firstRow});
    tile.draw(lists[t]);
    tile.copyTo(picture);
  });
}

Image renderSum(const Field& field, const RenderOptions& options, const RevoxeliseOptions& voxels) {
  const auto box = supportBox(field);
  Picture picture(options, box.value_or(kNoPlaces));
  refuseShading(options);
  if (box) checkRayLength(binsWithin(*box, picture.view, options.step));
  const auto ellipsoids = visibleEllipsoids(field, picture.view, options.resolution);
  const auto origins = chunkOrigins(field);
  const TileScene scene{options,
                        picture.view,
                        ellipsoids,
                        origins,
                        sampleRule(options, picture.table.view(), field.background),
                        makeVoxelRule(field.background, voxels)};
  parallelFor(0, tilesAlong(options.resolution.height), [&](int row) {
    checkCancelled(options);
    drawRow(scene, row * kTileSide, picture);
  });
  return picture.take();
}

}  // namespace

Image renderField(const Field& field, const RenderOptions& options,
                  const RevoxeliseOptions& voxels) {
  if (options.between == Between::kSum) return renderSum(field, options, voxels);
  checkRenderOptions(options);
  LazyCells cells(field, voxels);
  return renderCells(cells, options);
}

}  // namespace esvr
