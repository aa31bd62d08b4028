#include "render/window_tile.h"

#include <algorithm>
#include <cmath>

namespace esvr {
namespace {

/// The limits keep a window in the processor's cache.
constexpr WindowLimits kLimits{.slabs = 256, .voxels = 1 << 15};
/// A block is not split below this number of samples unless it has a single ray.
constexpr int kFewSamples = 8;

int extent(int first, int last) { return last - first + 1; }

}  // namespace

WindowTile::WindowTile(const TileScene& scene, TilePlace place) : Tile(scene, place) {
  slabs_.reserve(kLimits.slabs);
}

void WindowTile::drawBin(std::int64_t bin, std::span<const Entry> active) {
  const PixelRectangle all{place_.column, place_.column + columns_ - 1, place_.row,
                           place_.row + rows_ - 1};
  drawBlock({all, double(bin) * kBinSamples, kBinSamples}, active);
}

void WindowTile::drawBlock(const Block& block, std::span<const Entry> active) {
  const RayBundle bundle = bundleOf(scene_.view, block.pixels);
  const DepthRange depths = depthsOf(bundle, block.firstSample,
                                     block.firstSample + block.samples - 1, scene_.options.step);
  VoxelWindow shape{};
  if (!windowFor(bundle, depths, kLimits, shape)) return drawParts(block, active);
  layOut(bundle, shape);
  bool any = false;
  for (const Entry& entry : active) any |= addForm(scene_.ellipsoids.forms[entry.ellipsoid]);
  if (!any) return;
  finishVoxels();
  const PixelRectangle& p = block.pixels;
  for (int row = p.firstRow; row <= p.lastRow; ++row)
    for (int column = p.firstColumn; column <= p.lastColumn; ++column) drawRay(block, column, row);
}

/// Draws the two halves of a block whose window is too large, from front to back. The window of a
/// single sample always fits, so the recursion ends.
void WindowTile::drawParts(const Block& block, std::span<const Entry> active) {
  const PixelRectangle& p = block.pixels;
  const int columns = extent(p.firstColumn, p.lastColumn), rows = extent(p.firstRow, p.lastRow);
  const bool onePixel = columns == 1 && rows == 1;
  if (block.samples > kFewSamples || (onePixel && block.samples > 1)) {
    const int half = block.samples / 2;
    drawBlock({p, block.firstSample, half}, active);
    return drawBlock({p, block.firstSample + half, block.samples - half}, active);
  }
  Block one = block, other = block;
  if (columns >= rows) {
    one.pixels.lastColumn = p.firstColumn + columns / 2 - 1;
    other.pixels.firstColumn = one.pixels.lastColumn + 1;
  } else {
    one.pixels.lastRow = p.firstRow + rows / 2 - 1;
    other.pixels.firstRow = one.pixels.lastRow + 1;
  }
  drawBlock(one, active);
  drawBlock(other, active);
}

void WindowTile::layOut(const RayBundle& bundle, const VoxelWindow& shape) {
  window_.shape = shape;
  window_.origin = originOf(bundle, shape);
  window_.corner[shape.axes.slab] = window_.origin.slab;
  window_.corner[shape.axes.row] = window_.origin.row;
  window_.corner[shape.axes.column] = window_.origin.column;
  slabs_.clear();
  for (int s = 0; s < shape.slabs; ++s) slabs_.push_back(slabOf(bundle, shape, window_.origin, s));
  values_.assign(std::size_t(shape.voxels()), 0.0f);
  filled_.assign(std::size_t(shape.slabs), 0);
}

bool WindowTile::addForm(const WindowForm& form) {
  const WindowAxes& axes = window_.shape.axes;
  const Vec3 from = difference(scene_.origins[form.chunk], window_.corner);
  const auto at = [&](int axis) { return float(from[axis]) + form.center[axis]; };
  const WindowPlace center{at(axes.slab), at(axes.row), at(axes.column)};
  const WindowOrder& order = form.order[axes.slab];
  const WholeRange slabs = wholeWithin(center.slab - order.slabs, center.slab + order.slabs,
                                       {0, window_.shape.slabs - 1});
  bool any = false;
  for (int s = slabs.first; s <= slabs.last; ++s) {
    const int first = slabs_[s].row, last = first + window_.shape.rows - 1;
    const WindowExtent met = rowsOf(form.kernel, order, float(s) - center.slab);
    const WholeRange rows = wholeWithin(center.row + met.low, center.row + met.high, {first, last});
    for (int r = rows.first; r <= rows.last; ++r) any |= addRow(form, center, s, r);
  }
  return any;
}

bool WindowTile::addRow(const WindowForm& form, const WindowPlace& center, int slab, int row) {
  const WindowSlab& at = slabs_[slab];
  const WindowRun run = runOn(form.kernel, form.order[window_.shape.axes.slab],
                              {float(slab) - center.slab, float(row) - center.row, center.column,
                               at.column, at.column + window_.shape.columns - 1});
  float* const values = values_.data() + at.start + row * window_.shape.columns;
  for (int c = run.first; c <= run.last; ++c) values[c] += valueAt(form.kernel, run, c);
  if (run.first <= run.last) filled_[slab] = 1;
  return run.first <= run.last;
}

void WindowTile::finishVoxels() {
  const float background = scene_.rule.background;
  for (float& v : values_) v = v == 0.0f ? background : scene_.voxelRule(background + v);
}

void WindowTile::drawRay(const Block& block, int column, int row) {
  const int pixel = (row - place_.row) * kTileSide + column - place_.column;
  const Ray ray = scene_.view.ray(column, row);
  const WindowAxes& axes = window_.shape.axes;
  for (int i = 0; i < block.samples && alive(pixel); ++i) {
    const double number = block.firstSample + i;
    const Vec3 place = difference(
        sum(ray.origin, scaled(ray.direction, number * scene_.options.step)), window_.corner);
    const WindowPlace p{float(place[axes.slab]), float(place[axes.row]), float(place[axes.column])};
    const auto slab = std::size_t(p.slab);
    if (filled_[slab] == 0 && filled_[slab + 1] == 0) continue;
    const float value = interpolate(values_.data(), slabs_.data(), window_.shape.columns, p);
    if (value != scene_.rule.background) add(pixel, value, number);
  }
}

}  // namespace esvr
