#include "render/tile.h"

#include <algorithm>

namespace esvr {

Tile::Tile(const TileScene& scene, TilePlace place)
    : scene_(scene),
      place_(place),
      columns_(std::min(kTileSide, scene.options.resolution.width - place.column)),
      rows_(std::min(kTileSide, scene.options.resolution.height - place.row)),
      clips_(kPixels),
      rays_(kPixels) {
  const ClipBox clip = clipOf(scene.options);
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      clips_[row * kTileSide + column] = samplesIn(
          scene.view.ray(place.column + column, place.row + row), clip, scene.options.step);
}

std::vector<Tile::Entry> Tile::entries(std::span<const std::uint32_t> ellipsoids) const {
  const UnitRange unit = unitRange(scene_.view, place_.column, place_.column + columns_ - 1,
                                   place_.row, place_.row + rows_ - 1);
  std::vector<Entry> all;
  all.reserve(ellipsoids.size());
  for (const std::uint32_t p : ellipsoids)
    all.push_back({binsOf(scene_.ellipsoids.bounds[p], unit, scene_.options.step), p});
  std::stable_sort(all.begin(), all.end(),
                   [](const Entry& a, const Entry& b) { return a.bins.first < b.bins.first; });
  return all;
}

void Tile::draw(std::span<const std::uint32_t> ellipsoids) {
  const auto all = entries(ellipsoids);
  std::vector<Entry> active;
  auto next = all.begin();
  for (std::int64_t bin = 0; next != all.end() || !active.empty(); ++bin) {
    if (active.empty()) bin = std::max(bin, next->bins.first);  // skips bins without ellipsoids
    for (; next != all.end() && next->bins.first <= bin; ++next) active.push_back(*next);
    drawBin(bin, active);
    if (!anyAlive()) return;
    std::erase_if(active, [bin](const Entry& e) { return e.bins.last <= bin; });
  }
}

void Tile::add(int pixel, float value, double number) {
  if (alive(pixel) && clips_[pixel].has(number))
    scene_.rule.add(rays_[pixel], value,
                    sampleNumber(number, scene_.view.before / scene_.options.step));
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
