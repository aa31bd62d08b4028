#include "render/tile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace esvr {
namespace {

/// The bits of samples first to last; none where last is before first.
std::uint32_t samplesFrom(int first, int last) {
  constexpr std::uint64_t kOne = 1;
  return last < first ? 0u : std::uint32_t((kOne << (last + 1)) - (kOne << first));
}

/// Of the ray through the middle of a whole tile.
double middleUnit(const TileScene& scene, TilePlace place) {
  constexpr double kMiddle = (kTileSide - 1) / 2.0;
  const View& view = scene.view;
  return view.unitAlong(view.planeX(place.column + kMiddle), view.planeY(place.row + kMiddle)) /
         scene.options.step;
}

}  // namespace

Tile::Tile(const TileScene& scene, TilePlace place)
    : scene_(scene),
      place_(place),
      columns_(std::min(kTileSide, scene.options.resolution.width - place.column)),
      rows_(std::min(kTileSide, scene.options.resolution.height - place.row)),
      middleUnit_(middleUnit(scene, place)),
      scales_(kPixels),
      clips_(kPixels),
      rays_(kPixels),
      sums_(std::size_t(kPixels) * kBinSamples, 0.0f),
      touched_(kPixels, 0u) {
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      lookAlong(place.column + column, place.row + row, row * kTileSide + column);
}

void Tile::lookAlong(int column, int row, int pixel) {
  const View& view = scene_.view;
  const double step = scene_.options.step;
  const double unit = view.unitAlong(view.planeX(column), view.planeY(row)) / step;
  scales_[pixel] = {float(unit), float(unit - middleUnit_)};
  clips_[pixel] = samplesIn(view.ray(column, row), clipOf(scene_.options), step);
}

std::vector<Tile::Entry> Tile::entries(std::span<const std::uint32_t> primitives) const {
  const UnitRange unit = unitRange(scene_.view, place_.column, place_.column + columns_ - 1,
                                   place_.row, place_.row + rows_ - 1);
  std::vector<Entry> all;
  all.reserve(primitives.size());
  for (const std::uint32_t p : primitives)
    all.push_back({binsOf(scene_.primitives.bounds[p], unit, scene_.options.step), p});
  std::stable_sort(all.begin(), all.end(),
                   [](const Entry& a, const Entry& b) { return a.bins.first < b.bins.first; });
  return all;
}

void Tile::draw(std::span<const std::uint32_t> primitives) {
  const auto all = entries(primitives);
  std::vector<Entry> active;
  auto next = all.begin();
  for (std::int64_t bin = 0; next != all.end() || !active.empty(); ++bin) {
    if (active.empty())
      bin = std::max(bin, next->bins.first);  // bins without primitives cost nothing
    for (; next != all.end() && next->bins.first <= bin; ++next) active.push_back(*next);
    drawBin(bin, active);
    if (!anyAlive()) return;
    std::erase_if(active, [bin](const Entry& e) { return e.bins.last <= bin; });
  }
}

void Tile::drawBin(std::int64_t bin, std::span<const Entry> active) {
  for (const Entry& entry : active) addPrimitive(bin, entry.primitive);
  composite(bin);
}

Tile::PlacedPrimitive Tile::placed(const PrimitiveView& p, std::int64_t bin) const {
  return {p, float(place_.column - p.column), float(place_.row - p.row),
          float(p.depth * middleUnit_ - double(bin) * kBinSamples)};
}

void Tile::addPrimitive(std::int64_t bin, std::uint32_t primitive) {
  const ScreenBounds& b = scene_.primitives.bounds[primitive];
  const PlacedPrimitive p = placed(scene_.primitives.views[primitive], bin);
  const int lastRow = std::min(b.lastRow - place_.row, rows_ - 1);
  const int lastColumn = std::min(b.lastColumn - place_.column, columns_ - 1);
  for (int row = std::max(0, b.firstRow - place_.row); row <= lastRow; ++row)
    for (int column = std::max(0, b.firstColumn - place_.column); column <= lastColumn; ++column)
      if (alive(row * kTileSide + column)) addToRay(p, column, row);
}

void Tile::addToRay(const PlacedPrimitive& p, int column, int row) {
  const int pixel = row * kTileSide + column;
  const RayForm& form = p.view.form;
  const RaySpan span = spanOn(form, p.column + float(column), p.row + float(row), scales_[pixel],
                              float(p.view.depth), p.middleAhead);
  touched_[pixel] |= samplesFrom(span.first, span.last);
  float* sums = &sums_[std::size_t(pixel) * kBinSamples];
  for (int i = span.first; i <= span.last; ++i) sums[i] += valueAt(form, span, i);
}

void Tile::compositeRay(int pixel, double firstSample) {
  float* sums = &sums_[std::size_t(pixel) * kBinSamples];
  for (std::uint32_t left = touched_[pixel]; left != 0; left &= left - 1) {
    const int sample = std::countr_zero(left);
    const float sum = std::exchange(sums[sample], 0.0f);
    const double number = firstSample + sample;
    if (sum != 0.0f && alive(pixel) && clips_[pixel].has(number))
      scene_.rule.add(rays_[pixel], scene_.rule.background + sum, float(number));
  }
  touched_[pixel] = 0;
}

void Tile::composite(std::int64_t bin) {
  for (int pixel = 0; pixel < kPixels; ++pixel)
    if (touched_[pixel] != 0) compositeRay(pixel, double(bin) * kBinSamples);
}

bool Tile::anyAlive() const {
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      if (alive(row * kTileSide + column)) return true;
  return false;
}

void Tile::copyTo(Picture& picture) const {
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      picture.set(place_.column + column, place_.row + row,
                  scene_.rule.finished(rays_[row * kTileSide + column]));
}

}  // namespace esvr
