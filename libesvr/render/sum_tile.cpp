#include "render/sum_tile.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace esvr {
namespace {

/// Sets the bits of the samples first to last; no bit if last < first.
std::uint32_t samplesFrom(int first, int last) {
  constexpr std::uint64_t kOne = 1;
  return last < first ? 0u : std::uint32_t((kOne << (last + 1)) - (kOne << first));
}

/// Number of samples per unit of depth along forward, on the ray through the middle of the tile.
double middleUnit(const TileScene& scene, TilePlace place) {
  constexpr double kMiddle = (kTileSide - 1) / 2.0;
  const View& view = scene.view;
  return view.unitAlong(view.planeX(place.column + kMiddle), view.planeY(place.row + kMiddle)) /
         scene.options.step;
}

}  // namespace

SumTile::SumTile(const TileScene& scene, TilePlace place)
    : Tile(scene, place),
      middleUnit_(middleUnit(scene, place)),
      scales_(kPixels),
      sums_(std::size_t(kPixels) * kBinSamples, 0.0f),
      touched_(kPixels, 0u) {
  const View& view = scene.view;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const double x = view.planeX(place.column + column), y = view.planeY(place.row + row);
      const double unit = view.unitAlong(x, y) / scene.options.step;
      scales_[row * kTileSide + column] = {float(unit), float(unit - middleUnit_)};
    }
}

void SumTile::drawBin(std::int64_t bin, std::span<const Entry> active) {
  for (const Entry& entry : active) addEllipsoid(bin, entry.ellipsoid);
  for (int pixel = 0; pixel < kPixels; ++pixel)
    if (touched_[pixel] != 0) compositeRay(pixel, double(bin) * kBinSamples);
}

SumTile::PlacedEllipsoid SumTile::placed(const EllipsoidView& p, std::int64_t bin) const {
  return {p, float(place_.column - p.column), float(place_.row - p.row),
          float(p.depth * middleUnit_ - double(bin) * kBinSamples)};
}

void SumTile::addEllipsoid(std::int64_t bin, std::uint32_t ellipsoid) {
  const ScreenBounds& b = scene_.ellipsoids.bounds[ellipsoid];
  const PlacedEllipsoid p = placed(scene_.ellipsoids.views[ellipsoid], bin);
  const int lastRow = std::min(b.lastRow - place_.row, rows_ - 1);
  const int lastColumn = std::min(b.lastColumn - place_.column, columns_ - 1);
  for (int row = std::max(0, b.firstRow - place_.row); row <= lastRow; ++row)
    for (int column = std::max(0, b.firstColumn - place_.column); column <= lastColumn; ++column)
      if (alive(row * kTileSide + column)) addToRay(p, column, row);
}

void SumTile::addToRay(const PlacedEllipsoid& p, int column, int row) {
  const int pixel = row * kTileSide + column;
  const RayForm& form = p.view.form;
  const RaySpan span = spanOn(form, p.column + float(column), p.row + float(row), scales_[pixel],
                              float(p.view.depth), p.middleAhead);
  touched_[pixel] |= samplesFrom(span.first, span.last);
  float* sums = &sums_[std::size_t(pixel) * kBinSamples];
  for (int i = span.first; i <= span.last; ++i) sums[i] += valueAt(form, span, i);
}

void SumTile::compositeRay(int pixel, double firstSample) {
  float* sums = &sums_[std::size_t(pixel) * kBinSamples];
  for (std::uint32_t left = touched_[pixel]; left != 0; left &= left - 1) {
    const int sample = std::countr_zero(left);
    const float sum = std::exchange(sums[sample], 0.0f);
    const float value = scene_.voxelRule.settled(scene_.rule.background + sum);
    if (value != scene_.rule.background) add(pixel, value, firstSample + sample);
  }
  touched_[pixel] = 0;
}

}  // namespace esvr
