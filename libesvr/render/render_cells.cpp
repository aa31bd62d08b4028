// Draws the voxels of a field on the CPU. Rays march through bricks of cells, which are decoded
// when a ray first reads them.
#include "render/render_cells.h"

#include <tbb/blocked_range2d.h>

#include <algorithm>
#include <limits>

#include "core/parallel.h"
#include "field/coarser_field.h"

namespace esvr {

// Bricks.

namespace {

/// The bricks of level 0 or, where coarser levels are sums, of a coarser one.
/// \param voxels  rule of the level
std::vector<Coord> voxelCorners(const Field& inLevel, const RevoxeliseOptions& voxels, int level) {
  if (level > 0) return coarserReach(inLevel, voxels.box);
  std::vector<Coord> reached = reachedBricks(inLevel, voxels.box);
  if (!voxels.restrictToBricks) return reached;
  std::vector<Coord> both;
  std::ranges::set_intersection(reached, voxels.bricks, std::back_inserter(both));
  return both;
}

bool differs(std::span<const float> values, float background) {
  return std::ranges::any_of(values, [&](float v) { return v != background; });
}

/// LazyCells::roughBox()
std::optional<PlaceBox> roughBoxOf(const Field& field, const Box& voxels) {
  Box bricks;
  for (const Support& support : supports(field)) {
    const Box reached = common(brickRange(support), bricksOf(voxels));
    if (!reached.empty()) bricks.expand(reached);
  }
  if (bricks.empty()) return std::nullopt;
  // The cells below the first voxels belong to the bricks before them.
  const Vec3 low = pointOf(bricks.min), high = pointOf(bricks.max);
  return PlaceBox{scaled(difference(low, {1.0, 1.0, 1.0}), kBrickSide),
                  scaled(sum(high, {1.0, 1.0, 1.0}), kBrickSide)};
}

}  // namespace

LevelSums::LevelSums(const Field& inLevel, const RevoxeliseOptions& rule, const Box& box, int level)
    : level_(level),
      box_(box),
      voxels_(rule),
      rule_(makeVoxelRule(inLevel.background, rule)),
      field_(inLevel),
      corners_(voxelCorners(inLevel, rule, level)),
      evaluator_(field_, corners_) {}

bool LevelSums::decode(std::uint32_t number, std::span<float, kBrickVoxels> values) const {
  evaluator_.evaluate(number, values);
  (void)settle(rule_, regionIn(voxels_, corners_[number]), values);
  if (level_ > 0) mixWithBox(corners_[number], values);
  return differs(values, rule_.background);
}

/// Mixes voxels at the border of the box with the background outside.
void LevelSums::mixWithBox(Coord corner, std::span<float, kBrickVoxels> values) const {
  const Coord last = corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1};
  if (shareWithin(box_, level_, corner) == 1.0f && shareWithin(box_, level_, last) == 1.0f) return;
  for (int v = 0; v < kBrickVoxels; ++v) {
    const float share = shareWithin(box_, level_, corner + voxelLocal(v));
    float& value = values[std::size_t(v)];
    if (share < 1.0f) value = brick_march::between(rule_.background, value, share);
  }
}

LazyCells::Level::Level(std::span<const Coord> bricks, std::uint32_t firstCells)
    : index(bricks),
      table(makeBrickTable(bricksWithCells(bricks), firstCells)),
      voxels(bricks.size()),
      cells(table.bricks.size()) {}

LazyCells::LazyCells(const Field& field, const RevoxeliseOptions& voxels)
    : field_(field), voxels_(voxels), coarserAreSums_(hasCoarserFields(field, voxels)) {
  if (coarserAreSums_) roughBox_ = roughBoxOf(field, voxels.box);
}

void LazyCells::prepare(int first, int last) {
  for (int level = coarserAreSums_ ? first : 0; level <= last; ++level)
    if (!isPrepared(level)) make(level);
}

void LazyCells::make(int level) {
  std::uint32_t firstCells = 0;
  if (!made_.empty()) {
    const BrickTable& before = table(made_.back());
    firstCells = before.first + std::uint32_t(before.bricks.size());
  }
  std::unique_ptr<const LevelSums> sums;
  if (level == 0)
    sums = std::make_unique<LevelSums>(field_, voxels_, voxels_.box, 0);
  else if (coarserAreSums_)
    sums = std::make_unique<LevelSums>(coarserField(field_, level), coarserRule(voxels_, level),
                                       voxels_.box, level);
  const std::vector<Coord> bricks =
      sums ? bricksAt(sums->corners())
           : coarserBricks(levels_[std::size_t(level) - 1]->index.bricks());
  auto made = std::make_unique<Level>(bricks, firstCells);
  made->sums = std::move(sums);
  levels_[std::size_t(level)] = std::move(made);
  made_.push_back(level);
}

const float* LazyCells::values(std::uint32_t brick) const {
  auto level = made_.rbegin();
  while (brick < table(*level).first) ++level;
  const Level& l = *levels_[std::size_t(*level)];
  const std::size_t number = brick - l.table.first;
  return l.cells.get(number, [&](std::span<float, kCellBrickVoxels> values) {
    const auto find = [&](Coord at) { return voxelsOf(*level, at); };
    return fillCells(cornerBricks(l.table.place(number), find), field_.background, values);
  });
}

/// The voxels of a brick, or null if all of them are the background.
const float* LazyCells::voxelsOf(int level, Coord brick) const {
  const Level& l = *levels_[std::size_t(level)];
  const std::uint32_t number = l.index.find(brick);
  if (number == BrickIndex::kNone) return nullptr;
  return l.voxels.get(number, [&](std::span<float, kBrickVoxels> values) {
    return l.sums ? l.sums->decode(number, values) : average(level, brick, values);
  });
}

/// Averages the bricks of the next finer level. Those of level 0 are not kept, because a picture
/// that needs their means does not read them again.
bool LazyCells::average(int level, Coord brick, std::span<float, kBrickVoxels> values) const {
  std::ranges::fill(values, field_.background);
  std::array<float, kBrickVoxels> decoded;
  const Level& finest = *levels_[0];
  for (int c = 0; c < kCellCorners; ++c) {
    const Coord finer = brick * 2 + stepToCorner(c);
    if (level > 1) {
      if (const float* const voxels = voxelsOf(level - 1, finer))
        averageInto(std::span<const float, kBrickVoxels>(voxels, kBrickVoxels), c, values);
    } else if (const auto number = finest.index.find(finer); number != BrickIndex::kNone) {
      if (finest.sums->decode(number, decoded)) averageInto(decoded, c, values);
    }
  }
  return differs(values, field_.background);
}

void LazyCells::forget() {
  for (const int made : made_) {
    levels_[std::size_t(made)]->voxels.forget();
    levels_[std::size_t(made)]->cells.forget();
  }
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

/// A box that contains all cells that a picture shows. Level 0 is prepared for it unless even the nearest
/// samples have a coarser level that does not need it.
PlaceBox boxFor(LazyCells& cells, const RenderOptions& options) {
  if (const auto& rough = cells.roughBox()) {
    checkRenderOptions(options);
    if (levelBounds(options, viewOf(options, *rough), *rough).first > 0) return *rough;
  }
  cells.prepare(0, 0);
  return cellBoxOf(cells.table(0));
}

}  // namespace

Image renderCells(LazyCells& cells, const RenderOptions& options) {
  const PlaceBox box = boxFor(cells, options);
  Picture picture(options, box);
  if (box.low[0] > box.high[0]) return picture.take();  // nothing to draw
  LevelScene scene{marchScene(options, picture.view,
                              sampleRule(options, picture.table.view(), cells.background())),
                   levelBounds(options, picture.view, box),
                   {}};
  const LevelBounds& bounds = scene.bounds;
  cells.prepare(bounds.first, bounds.last);
  if (cells.table(bounds.last).bricks.empty()) return picture.take();
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
