// Draws the voxels of a field on the CPU. Rays march through bricks of cells, which are decoded
// when a ray first reads them.
#include "render/render_cells.h"

#include <tbb/blocked_range2d.h>

#include <algorithm>
#include <limits>

#include "core/parallel.h"
#include "field/voxel_rule.h"

namespace esvr {

// Bricks.

namespace {

std::vector<Coord> voxelCorners(const Field& field, const RevoxeliseOptions& voxels) {
  std::vector<Coord> reached = reachedBricks(field, voxels.box);
  if (!voxels.restrictToBricks) return reached;
  std::vector<Coord> both;
  std::ranges::set_intersection(reached, voxels.bricks, std::back_inserter(both));
  return both;
}

bool differs(std::span<const float> values, float background) {
  return std::ranges::any_of(values, [&](float v) { return v != background; });
}

}  // namespace

LazyCells::Level::Level(std::span<const Coord> bricks, std::uint32_t firstCells)
    : index(bricks),
      table(makeBrickTable(bricksWithCells(bricks), firstCells)),
      voxels(bricks.size()),
      cells(table.bricks.size()) {}

LazyCells::LazyCells(const Field& field, const RevoxeliseOptions& voxels)
    : field_(field),
      voxels_(voxels),
      rule_(makeVoxelRule(field.background, voxels)),
      corners_(voxelCorners(field, voxels)),
      evaluator_(field_, corners_) {
  levels_.push_back(std::make_unique<Level>(bricksAt(corners_), 0u));
}

void LazyCells::prepare(int lastLevel) {
  while (int(levels_.size()) <= lastLevel) {
    const Level& finer = *levels_.back();
    levels_.push_back(
        std::make_unique<Level>(coarserBricks(finer.index.bricks()),
                                finer.table.first + std::uint32_t(finer.table.bricks.size())));
  }
}

const float* LazyCells::values(std::uint32_t brick) const {
  int level = int(levels_.size()) - 1;
  while (brick < table(level).first) --level;
  const Level& l = *levels_[std::size_t(level)];
  const std::size_t number = brick - l.table.first;
  return l.cells.get(number, [&](std::span<float, kCellBrickVoxels> values) {
    const auto find = [&](Coord at) { return voxelsOf(level, at); };
    return fillCells(cornerBricks(l.table.place(number), find), rule_.background, values);
  });
}

/// The voxels of a brick, or null if all of them are the background.
const float* LazyCells::voxelsOf(int level, Coord brick) const {
  const Level& l = *levels_[std::size_t(level)];
  const std::uint32_t number = l.index.find(brick);
  if (number == BrickIndex::kNone) return nullptr;
  return l.voxels.get(number, [&](std::span<float, kBrickVoxels> values) {
    return level == 0 ? decode(number, values) : average(level, brick, values);
  });
}

bool LazyCells::decode(std::uint32_t number, std::span<float, kBrickVoxels> values) const {
  evaluator_.evaluate(number, values);
  (void)settle(rule_, regionIn(voxels_, corners_[number]), values);
  return differs(values, rule_.background);
}

/// Averages the bricks of the next finer level. Those of level 0 are not kept, because a picture
/// that needs their means does not read them again.
bool LazyCells::average(int level, Coord brick, std::span<float, kBrickVoxels> values) const {
  std::ranges::fill(values, rule_.background);
  std::array<float, kBrickVoxels> decoded;
  for (int c = 0; c < kCellCorners; ++c) {
    const Coord finer = brick * 2 + stepToCorner(c);
    if (level > 1) {
      if (const float* const voxels = voxelsOf(level - 1, finer))
        averageInto(std::span<const float, kBrickVoxels>(voxels, kBrickVoxels), c, values);
    } else if (const auto number = levels_[0]->index.find(finer); number != BrickIndex::kNone) {
      if (decode(number, decoded)) averageInto(decoded, c, values);
    }
  }
  return differs(values, rule_.background);
}

void LazyCells::forget() {
  for (const auto& level : levels_) level->voxels.forget(), level->cells.forget();
}

// Tiles.

TileRanges::TileRanges(Resolution resolution)
    : resolution_(resolution),
      columns_((resolution.width + kSide - 1) / kSide),
      rows_((resolution.height + kSide - 1) / kSide),
      ranges_(std::size_t(columns_) * std::size_t(rows_),
              {std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {}

void TileRanges::add(const CoverView& view, const std::vector<Coord>& bricks) {
  for (const Coord brick : bricks) {
    BrickCover cover = coverOfCorner(view, brick, 0);
    for (int c = 1; c < kCellCorners; ++c) {
      const BrickCover corner = coverOfCorner(view, brick, c);
      cover = {std::min(cover.firstColumn, corner.firstColumn),
               std::max(cover.lastColumn, corner.lastColumn),
               std::min(cover.firstRow, corner.firstRow),
               std::max(cover.lastRow, corner.lastRow),
               std::min(cover.first, corner.first),
               std::max(cover.last, corner.last)};
    }
    if (view.view.perspective) cover.first = firstSampleOf(view, brick);
    const CoveredTiles tiles = tilesOf(view, cover, kSide);
    for (int row = tiles.firstRow; row < tiles.firstRow + tiles.rows; ++row)
      for (int column = tiles.firstColumn; column < tiles.firstColumn + tiles.columns; ++column) {
        Samples& range = ranges_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)];
        range.first = std::min(range.first, cover.first);
        range.last = std::max(range.last, cover.last);
      }
  }
}

void TileRanges::draw(const RenderOptions& options, Picture& picture,
                      const std::function<PixelColor(int, int, const Samples&)>& colorOf) const {
  const auto drawTile = [&](int tileColumn, int tileRow) {
    const Samples samples =
        ranges_[std::size_t(tileRow) * std::size_t(columns_) + std::size_t(tileColumn)];
    if (samples.last < samples.first) return;
    const int pastColumn = std::min((tileColumn + 1) * kSide, resolution_.width);
    const int pastRow = std::min((tileRow + 1) * kSide, resolution_.height);
    for (int row = tileRow * kSide; row < pastRow; ++row)
      for (int column = tileColumn * kSide; column < pastColumn; ++column) {
        checkCancelled(options);  // a single ray may take a tenth of a second
        picture.set(column, row, colorOf(column, row, samples));
      }
  };
  using Tiles = tbb::blocked_range2d<int>;
  parallelFor(Tiles(0, rows_, 0, columns_), [&](const Tiles& tiles) {
    for (int row = tiles.rows().begin(); row != tiles.rows().end(); ++row)
      for (int column = tiles.cols().begin(); column != tiles.cols().end(); ++column)
        drawTile(column, row);
  });
}

// Pictures.

namespace {

/// A box that contains all cells, in index space.
PlaceBox cellBoxOf(const BrickTable& table) {
  const PlaceBox cells = cellsOf(table);
  const Vec3 origin = pointOf(table.origin);
  return {sum(cells.low, origin), sum(cells.high, origin)};
}

}  // namespace

Image renderCells(LazyCells& cells, const RenderOptions& options) {
  Picture picture(options, cellBoxOf(cells.table(0)));
  if (cells.table(0).bricks.empty()) return picture.take();
  LevelScene scene{marchScene(options, picture.view,
                              sampleRule(options, picture.table.view(), cells.background())),
                   levelBounds(options, picture.view, cellBoxOf(cells.table(0))),
                   {}};
  const LevelBounds& bounds = scene.bounds;
  cells.prepare(bounds.last);
  const LevelTables tables(picture, options, bounds);
  for (int level = bounds.first; level <= bounds.last; ++level)
    scene.levels[level - bounds.first] = {cells.table(level).view(), cellsOf(cells.table(level)),
                                          tables.view(level)};

  // Tiles find their ranges among the bricks of the coarsest level, which are the fewest.
  const LevelFrame last{bounds.last};
  const BrickTable& coarsest = cells.table(bounds.last);
  const View view = sceneOfLevel(scene.scene, last, coarsest.origin).view;
  const BinRange bins = binsWithin(cellsOf(coarsest), view, options.step);
  checkRayLength(bins);
  const double firstSample = double(bins.first) * kBinSamples;
  TileRanges ranges(options.resolution);
  ranges.add({view, options.resolution, options.step, firstSample}, coarsest.bricks);

  ranges.draw(options, picture, [&](int column, int row, const TileRanges::Samples& range) {
    const SampleRange wanted{(firstSample + range.first) * last.side(),
                             (firstSample + range.last) * last.side()};
    RayProgress ray;
    AllBricksAreThere visitor;
    const LazySlots slots{cells};
    if (scene.scene.isShaded)
      (void)marchLevels<MarchCode{.isShaded = true}>(scene, slots, column, row, wanted, ray,
                                                     visitor);
    else
      (void)marchLevels<MarchCode{}>(scene, slots, column, row, wanted, ray, visitor);
    return finished(scene, ray);
  });
  return picture.take();
}

}  // namespace esvr
