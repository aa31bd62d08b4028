#include "render/render_grids.h"

#include <algorithm>
#include <array>

#include "render/draw_tiles.h"
#include "render/grids_scene.h"

namespace esvr {
namespace {

/// The tables of the grids after the first one, whose table the picture has.
std::vector<TransferTable> furtherTables(const RenderOptions& options) {
  std::vector<TransferTable> tables;
  for (const GridLook& look : options.further)
    tables.emplace_back(look.transfer, samplingOf(options));
  return tables;
}

GridsScene sceneOf(const std::vector<GridCells>& grids, const RenderOptions& options,
                   const TransferTable& first, const std::vector<TransferTable>& further) {
  std::vector<GridTable> tables;
  for (std::size_t g = 0; g < grids.size(); ++g)
    tables.push_back({grids[g].table().view(), cellsOf(grids[g].table()),
                      g == 0 ? first.view() : further[g - 1].view(), grids[g].background()});
  return gridsScene(options, tables);
}

class GridsPicture {
 public:
  /// \param first  table of the first grid; must outlive the object
  GridsPicture(const std::vector<GridCells>& grids, const RenderOptions& options,
               const TransferTable& first)
      : further_(furtherTables(options)),
        scene_(sceneOf(grids, options, first, further_)),
        firstSample_(firstSampleOf(scene_)),
        ranges_(options.resolution) {
    for (std::size_t g = 0; g < grids.size(); ++g) {
      slots_[g] = grids[g].slots();
      ranges_.add(coverViewOf(scene_, g, options.resolution), grids[g].table().bricks);
    }
  }

  [[nodiscard]] const TileRanges& tiles() const { return ranges_; }

  template <int kGrids>
  [[nodiscard]] PixelColor color(int column, int row, const TileSamples& range) const {
    const MarchSamples samples = samplesOf(scene_.scene, column, row,
                                           {firstSample_ + range.first, firstSample_ + range.last});
    GridsProgress ray;
    AllGridsAreThere visitor;
    (void)marchGrids<kGrids>(scene_, slots_.data(), samples, ray, visitor);
    return finished<kGrids>(scene_, ray);
  }

 private:
  std::vector<TransferTable> further_;
  GridsScene scene_;
  double firstSample_;
  std::array<GridSlots, kMostGrids> slots_{};
  TileRanges ranges_;
};

template <int kGrids>
void drawGrids(const GridsPicture& grids, const RenderOptions& options, Picture& picture) {
  drawTiles(options, grids.tiles(), picture, [&](int column, int row, const TileSamples& range) {
    return grids.color<kGrids>(column, row, range);
  });
}

using DrawGrids = void (*)(const GridsPicture&, const RenderOptions&, Picture&);
constexpr std::array<DrawGrids, kMostGrids> kDrawGrids{drawGrids<1>, drawGrids<2>, drawGrids<3>,
                                                       drawGrids<4>};

}  // namespace

GridCells::GridCells(const DrawnGrid& grid) {
  if (const auto* const drawn = std::get_if<DrawnField>(&grid)) {
    field_ = std::make_unique<LazyCells>(*drawn->field, drawn->voxels);
    background_ = field_->background();
  } else {
    const SparseVolume& volume = *std::get<const SparseVolume*>(grid);
    atlas_ = makeBrickAtlas(volume);
    pages_ = atlas_.pages();
    background_ = volume.background;
  }
}

Image renderGrids(const std::vector<GridCells>& grids, const RenderOptions& options) {
  checkGridsOptions(options, grids.size());
  Picture picture(options, kNoPlaces, grids.size());  // the scene has the view
  if (std::ranges::all_of(grids, [](const GridCells& g) { return g.table().bricks.empty(); }))
    return picture.take();
  kDrawGrids[grids.size() - 1](GridsPicture(grids, options, picture.table), options, picture);
  return picture.take();
}

}  // namespace esvr
