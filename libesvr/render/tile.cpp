#include "render/tile.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace esvr {
namespace {

Vec3 at(const LinearInPlane<Vec3>& f, double x, double y) {
  return {f.atOrigin[0] + x * f.perX[0] + y * f.perY[0],
          f.atOrigin[1] + x * f.perX[1] + y * f.perY[1],
          f.atOrigin[2] + x * f.perX[2] + y * f.perY[2]};
}
double at(const LinearInPlane<double>& f, double x, double y) {
  return f.atOrigin + x * f.perX + y * f.perY;
}

/// The bits of samples first to last; none where last is before first.
std::uint32_t samplesFrom(int first, int last) {
  constexpr std::uint64_t kOne = 1;
  return last < first ? 0u : std::uint32_t((kOne << (last + 1)) - (kOne << first));
}

}  // namespace

Tile::Tile(const TileScene& scene, TilePlace place)
    : scene_(scene),
      place_(place),
      columns_(std::min(kTileSide, scene.options.resolution.width - place.column)),
      rows_(std::min(kTileSide, scene.options.resolution.height - place.row)),
      places_(kPixels),
      rays_(kPixels),
      sums_(std::size_t(kPixels) * kBinSamples, 0.0f),
      touched_(kPixels, 0u) {
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      places_[row * kTileSide + column] = rayPlace(place.column + column, place.row + row);
}

Tile::RayPlace Tile::rayPlace(int column, int row) const {
  const double x = scene_.view.planeX(column), y = scene_.view.planeY(row);
  return {x, y, scene_.view.perspective ? std::hypot(x, y, 1.0) : 1.0};
}

Tile::Cosines Tile::cosines() const {
  if (!scene_.view.perspective) return {1.0, 1.0};
  const double x0 = scene_.view.planeX(place_.column), y0 = scene_.view.planeY(place_.row);
  const double x1 = scene_.view.planeX(place_.column + columns_ - 1);
  const double y1 = scene_.view.planeY(place_.row + rows_ - 1);
  const double farX = std::max(std::abs(x0), std::abs(x1));
  const double farY = std::max(std::abs(y0), std::abs(y1));
  const double nearX = std::clamp(0.0, x0, x1), nearY = std::clamp(0.0, y1, y0);
  return {1.0 / std::hypot(farX, farY, 1.0), 1.0 / std::hypot(nearX, nearY, 1.0)};
}

std::vector<Tile::Entry> Tile::entries(std::span<const std::uint32_t> primitives) const {
  constexpr double kRounding = 1e-6;  // samples: a bound may lie on one
  const Cosines cosine = cosines();
  const double binLength = scene_.options.step * kBinSamples;
  std::vector<Entry> all;
  all.reserve(primitives.size());
  for (const std::uint32_t p : primitives) {
    const ScreenBounds& b = scene_.primitives.bounds[p];
    const double first = b.nearest / cosine.most / binLength - kRounding;
    const double last = b.farthest / cosine.least / binLength + kRounding;
    all.push_back({std::max(std::int64_t(0), std::int64_t(std::floor(first))),
                   std::int64_t(std::floor(last)), p});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Entry& a, const Entry& b) { return a.firstBin < b.firstBin; });
  return all;
}

void Tile::draw(std::span<const std::uint32_t> primitives) {
  const auto all = entries(primitives);
  std::vector<Entry> active;
  auto next = all.begin();
  for (std::int64_t bin = 0; next != all.end() || !active.empty(); ++bin) {
    if (active.empty())
      bin = std::max(bin, next->firstBin);  // bins without primitives cost nothing
    for (; next != all.end() && next->firstBin <= bin; ++next) active.push_back(*next);
    drawBin(bin, active);
    if (!anyAlive()) return;
    std::erase_if(active, [bin](const Entry& e) { return e.lastBin <= bin; });
  }
}

void Tile::drawBin(std::int64_t bin, std::span<const Entry> active) {
  for (const Entry& entry : active) addPrimitive(bin, entry.primitive);
  composite();
}

void Tile::addPrimitive(std::int64_t bin, std::uint32_t primitive) {
  const ScreenBounds& b = scene_.primitives.bounds[primitive];
  const PrimitiveView& p = scene_.primitives.views[primitive];
  const double firstDistance = double(bin) * kBinSamples * scene_.options.step;
  const int lastRow = std::min(b.lastRow - place_.row, rows_ - 1);
  const int lastColumn = std::min(b.lastColumn - place_.column, columns_ - 1);
  for (int row = std::max(0, b.firstRow - place_.row); row <= lastRow; ++row)
    for (int column = std::max(0, b.firstColumn - place_.column); column <= lastColumn; ++column)
      if (const int pixel = row * kTileSide + column; alive(pixel))
        addToRay(p, pixel, firstDistance);
}

/// Along the ray, m(t) = nearest + speed (t - closest)^2: both terms are positive, so nothing
/// cancels, and float32 is enough once t is counted from the place of closest approach.
void Tile::addToRay(const PrimitiveView& p, int pixel, double firstDistance) {
  const auto [x, y, unitLength] = places_[pixel];
  const Vec3 along = at(p.along, x, y), beside = at(p.beside, x, y);
  const double along2 = inner(along, along), beside2 = inner(beside, beside);
  if (!(beside2 < double(p.kernel.cutoff) * along2)) return;  // passes by

  const double nearest = beside2 / along2, closest = -at(p.ahead, x, y) / along2 * unitLength;
  const double speed = along2 / (unitLength * unitLength);
  const double step = scene_.options.step;
  const double half = std::sqrt((p.kernel.cutoff - nearest) / speed) / step;
  const double middle = (closest - firstDistance) / step;  // in samples of this bin
  const int first = int(std::ceil(std::clamp(middle - half, 0.0, double(kBinSamples))));
  const int last = int(std::floor(std::clamp(middle + half, -1.0, kBinSamples - 1.0)));
  float* sums = &sums_[std::size_t(pixel) * kBinSamples];
  const float m0 = float(nearest), a = float(speed * step * step), from = float(middle - first);
  touched_[pixel] |= samplesFrom(first, last);
  for (int i = first; i <= last; ++i) {
    const float t = float(i - first) - from;
    sums[i] += p.intensity * kernelPhi(p.kernel, m0 + a * t * t);
  }
}

void Tile::composite() {
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    float* sums = &sums_[std::size_t(pixel) * kBinSamples];
    for (std::uint32_t left = touched_[pixel]; left != 0; left &= left - 1) {
      float& sum = sums[std::countr_zero(left)];
      if (sum != 0.0f && alive(pixel)) rays_[pixel].add(scene_.table(scene_.background + sum));
      sum = 0.0f;
    }
    touched_[pixel] = 0;
  }
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
      picture.set(place_.column + column, place_.row + row, rays_[row * kTileSide + column]);
}

}  // namespace esvr
