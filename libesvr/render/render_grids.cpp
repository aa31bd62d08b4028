// Pictures of several grids: the scene that CPU and CUDA share, and drawing on the CPU.
#include <algorithm>
#include <array>
#include <limits>

#include "esvr/error.h"
#include "render/grids_march.h"
#include "render/picture.h"
#include "render/render_cells.h"

namespace esvr {

// The scene.

void checkGridsOptions(const RenderOptions& options, std::size_t grids) {
  checkRenderOptions(options, grids);
  if (options.mode != RenderMode::kComposite)
    throw UsageError("several grids in one picture can only be composited");
  if (options.shading) throw UsageError("several grids in one picture cannot be shaded");
}

GridLook lookOf(const RenderOptions& options, std::size_t grid) {
  return grid == 0 ? GridLook{options.transfer} : options.further[grid - 1];
}

namespace {

bool isEmpty(const PlaceBox& box) { return !(box.low[0] < box.high[0]); }

/// A box around the cells of all grids, in index space.
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

}  // namespace

GridsScene gridsScene(const RenderOptions& options, const std::vector<GridTable>& grids) {
  // Places are relative to the origin of the first grid that has cells.
  const Coord origin =
      std::ranges::find_if(grids, [](const GridTable& g) { return !isEmpty(g.box); })->table.origin;
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

// Drawing on the CPU.

GridCells::GridCells(const DrawnGrid& grid) {
  if (const auto* const drawn = std::get_if<DrawnField>(&grid)) {
    field_ = std::make_unique<LazyCells>(*drawn->field, drawn->voxels);
    field_->prepare(0, 0);
    background_ = field_->background();
  } else {
    const SparseVolume& volume = *std::get<const SparseVolume*>(grid);
    atlas_ = makeBrickAtlas(volume);
    pages_ = atlas_.pages();
    background_ = volume.background;
  }
}

namespace {

/// The color of a pixel of a tile with these samples. A specialisation for each number of grids is
/// faster than a loop over them.
template <int kGrids>
PixelColor colorOf(const GridsScene& scene, const std::array<GridSlots, kMostGrids>& slots,
                   int column, int row, const SampleRange& range) {
  const MarchSamples samples = samplesOf(scene.scene, column, row, range);
  GridsProgress ray;
  AllGridsAreThere visitor;
  (void)marchGrids<kGrids>(scene, slots.data(), samples, ray, visitor);
  return finished<kGrids>(scene, ray);
}

}  // namespace

Image renderGrids(const std::vector<GridCells>& grids, const RenderOptions& options) {
  checkGridsOptions(options, grids.size());
  Picture picture(options, kNoPlaces, grids.size());  // the scene has the view
  if (std::ranges::all_of(grids, [](const GridCells& g) { return g.table().bricks.empty(); }))
    return picture.take();

  std::vector<TransferTable> further;  // those after the first, which the picture has
  for (const GridLook& look : options.further)
    further.emplace_back(look.transfer, samplingOf(options));
  std::vector<GridTable> tables;
  std::array<GridSlots, kMostGrids> slots{};
  for (std::size_t g = 0; g < grids.size(); ++g) {
    tables.push_back({grids[g].table().view(), cellsOf(grids[g].table()),
                      g == 0 ? picture.table.view() : further[g - 1].view(),
                      grids[g].background()});
    slots[g] = grids[g].slots();
  }
  const GridsScene scene = gridsScene(options, tables);
  const double firstSample = firstSampleOf(scene);
  TileRanges ranges(options.resolution);
  for (std::size_t g = 0; g < grids.size(); ++g)
    ranges.add(coverViewOf(scene, g, options.resolution), grids[g].table().bricks);

  constexpr std::array kColorOf{colorOf<1>, colorOf<2>, colorOf<3>, colorOf<4>};
  static_assert(kColorOf.size() == kMostGrids);
  const auto color = kColorOf[grids.size() - 1];
  ranges.draw(options, picture, [&](int column, int row, const TileRanges::Samples& range) {
    return color(scene, slots, column, row, {firstSample + range.first, firstSample + range.last});
  });
  return picture.take();
}

}  // namespace esvr
