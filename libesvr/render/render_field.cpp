// Draws the sum of ellipsoids on the CPU (Between::kSum): each sample of a ray is the sum of the
// ellipsoids that reach it.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "core/parallel.h"
#include "esvr/render.h"
#include "field/voxel_rule.h"
#include "render/ellipsoid_view.h"
#include "render/picture.h"
#include "render/render_cells.h"

namespace esvr {

// The ellipsoids of a field, as rays need them.

std::vector<PackedEllipsoid> packed(const Field& field) {
  std::vector<PackedEllipsoid> all;
  all.reserve(field.ellipsoidCount());
  for (std::uint32_t c = 0; c < field.chunks.size(); ++c) {
    const Ellipsoids& e = field.chunks[c].ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i) {
      PackedEllipsoid& p = all.emplace_back();
      for (int a = 0; a < 3; ++a) {
        p.center[a] = e.center[a][i];
        p.scale[a] = float(std::exp(double(e.logScale[a][i])));
      }
      for (int a = 0; a < 4; ++a) p.rotation[a] = e.rotation[a][i];
      p.intensity = e.intensity[i];
      p.chunk = c;
    }
  }
  return all;
}

std::vector<Vec3> chunkOrigins(const Field& field) {
  std::vector<Vec3> origins;
  for (const Chunk& chunk : field.chunks) origins.push_back(pointOf(chunk.origin));
  return origins;
}

std::vector<RayKernel> rayKernels(const Field& field) {
  const auto inBase2 = [&](double kappa) {
    constexpr double kLog2e = 1.4426950408889634;
    const auto k = kernelConstants<double>(field.kernel, kappa);
    return RayKernel{float(k.numerator), float(k.plateau), float(k.shift * kLog2e), float(k.base),
                     float(k.cutoff)};
  };
  const bool own = std::ranges::any_of(
      field.chunks, [](const Chunk& chunk) { return !chunk.ellipsoids.kappa.empty(); });
  if (!own) return {inBase2(field.kernel.kappa)};
  std::vector<RayKernel> kernels;
  for (const Chunk& chunk : field.chunks) {
    const auto& kappa = chunk.ellipsoids.kappa;
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i)
      kernels.push_back(inBase2(kappa.empty() ? field.kernel.kappa : kappa[i]));
  }
  return kernels;
}

std::optional<PlaceBox> supportBox(const Field& field) {
  const auto ellipsoids = packed(field);
  if (ellipsoids.empty()) return std::nullopt;
  const auto origins = chunkOrigins(field);
  const auto kernels = rayKernels(field);
  constexpr double kAll = std::numeric_limits<double>::infinity();
  PlaceBox box{{kAll, kAll, kAll}, {-kAll, -kAll, -kAll}};
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    // The sphere around a support is exact enough, because the box only decides where rays begin
    // and end.
    const PackedEllipsoid& e = ellipsoids[i];
    const double radius = std::sqrt(double(kernels[kernels.size() == 1 ? 0 : i].cutoff));
    const double reach = radius * std::max({e.scale[0], e.scale[1], e.scale[2]});
    for (int a = 0; a < 3; ++a) {
      const double center = origins[e.chunk][a] + e.center[a];
      box.low[a] = std::min(box.low[a], center - reach);
      box.high[a] = std::max(box.high[a], center + reach);
    }
  }
  return box;
}

VisibleEllipsoids visibleEllipsoids(const Field& field, const View& view, Resolution resolution) {
  const auto ellipsoids = packed(field);
  const auto origins = chunkOrigins(field);
  const auto kernels = rayKernels(field);
  VisibleEllipsoids out;
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    const PackedEllipsoid& e = ellipsoids[i];
    const RayKernel& kernel = kernels[kernels.size() == 1 ? 0 : i];
    const SeenEllipsoid seen = seenBy(view, e, difference(origins[e.chunk], view.eye));
    const ScreenExtent s = screenExtentOf(view, seen, std::sqrt(double(kernel.cutoff)), resolution);
    if (!visible(s.bounds)) continue;
    out.bounds.push_back(s.bounds);
    out.views.push_back(viewOf(view, seen, s.outline.everywhere, e.intensity, kernel));
  }
  return out;
}

// A tile is a square of pixels that is drawn together, bin by bin from front to back.

namespace {

constexpr int kTileSide = 16;  ///< pixels
constexpr int kTilePixels = kTileSide * kTileSide;
static_assert(kBinSamples == 32, "a bit of 32 for each sample of a bin");

int sumTilesAlong(int pixels) { return (pixels + kTileSide - 1) / kTileSide; }

/// What all tiles of a picture share.
struct SumScene {
  const RenderOptions& options;
  const View& view;
  const VisibleEllipsoids& ellipsoids;
  SampleRule rule;
  VoxelRule voxelRule;
};

/// Sets the bits of the samples first to last; no bit if last < first.
std::uint32_t samplesFrom(int first, int last) {
  constexpr std::uint64_t kOne = 1;
  return last < first ? 0u : std::uint32_t((kOne << (last + 1)) - (kOne << first));
}

class SumTile {
 public:
  /// \param column, row  first pixel of the tile
  SumTile(const SumScene& scene, int column, int row);

  /// \param ellipsoids  numbers of the ellipsoids whose bounds overlap the tile, increasing
  void draw(std::span<const std::uint32_t> ellipsoids);
  void copyTo(Picture& picture) const;

 private:
  /// An ellipsoid and the bins that it may touch.
  struct Entry {
    BinRange bins;
    std::uint32_t ellipsoid;
  };

  [[nodiscard]] std::vector<Entry> entries(std::span<const std::uint32_t> ellipsoids) const;
  void addEllipsoid(std::int64_t bin, std::uint32_t ellipsoid);
  void compositeRay(int pixel, double firstSample);
  [[nodiscard]] bool alive(int pixel) const { return scene_.rule.open(rays_[pixel]); }
  [[nodiscard]] bool anyAlive() const;

  const SumScene& scene_;
  int column_, row_;    ///< first pixel
  int columns_, rows_;  ///< pixels within the picture
  double middleUnit_;   ///< samples per unit of depth, on the ray through the middle of the tile
  // By pixel:
  std::vector<SampleRange> clips_;
  std::vector<RayScale> scales_;
  std::vector<RayState> rays_;
  std::vector<float> sums_;             ///< kBinSamples sums for each pixel
  std::vector<std::uint32_t> touched_;  ///< bit i is set if an ellipsoid was added to sum i
};

SumTile::SumTile(const SumScene& scene, int column, int row)
    : scene_(scene),
      column_(column),
      row_(row),
      columns_(std::min(kTileSide, scene.options.resolution.width - column)),
      rows_(std::min(kTileSide, scene.options.resolution.height - row)),
      clips_(kTilePixels),
      scales_(kTilePixels),
      rays_(kTilePixels),
      sums_(std::size_t(kTilePixels) * kBinSamples, 0.0f),
      touched_(kTilePixels, 0u) {
  const View& view = scene.view;
  const double step = scene.options.step;
  constexpr double kMiddle = (kTileSide - 1) / 2.0;
  middleUnit_ = view.unitAlong(view.planeX(column + kMiddle), view.planeY(row + kMiddle)) / step;
  const ClipBox clip = clipOf(scene.options);
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c) {
      const int pixel = r * kTileSide + c;
      clips_[pixel] = samplesIn(view.ray(column + c, row + r), clip, step);
      const double unit = view.unitAlong(view.planeX(column + c), view.planeY(row + r)) / step;
      scales_[pixel] = {float(unit), float(unit - middleUnit_)};
    }
}

/// The ellipsoids in the order of their first bins.
std::vector<SumTile::Entry> SumTile::entries(std::span<const std::uint32_t> ellipsoids) const {
  const UnitRange unit =
      unitRange(scene_.view, column_, column_ + columns_ - 1, row_, row_ + rows_ - 1);
  std::vector<Entry> all;
  all.reserve(ellipsoids.size());
  for (const std::uint32_t e : ellipsoids) {
    const ScreenBounds& b = scene_.ellipsoids.bounds[e];
    all.push_back({binsOf(b.nearest, b.farthest, unit, scene_.options.step), e});
  }
  std::ranges::stable_sort(all, {}, [](const Entry& entry) { return entry.bins.first; });
  return all;
}

void SumTile::draw(std::span<const std::uint32_t> ellipsoids) {
  const auto all = entries(ellipsoids);
  std::vector<Entry> active;
  auto next = all.begin();
  for (std::int64_t bin = 0; next != all.end() || !active.empty(); ++bin) {
    if (active.empty()) bin = std::max(bin, next->bins.first);  // skips bins without ellipsoids
    for (; next != all.end() && next->bins.first <= bin; ++next) active.push_back(*next);
    for (const Entry& entry : active) addEllipsoid(bin, entry.ellipsoid);
    for (int pixel = 0; pixel < kTilePixels; ++pixel)
      if (touched_[pixel] != 0) compositeRay(pixel, double(bin) * kBinSamples);
    if (!anyAlive()) return;
    std::erase_if(active, [bin](const Entry& e) { return e.bins.last <= bin; });
  }
}

/// Adds an ellipsoid to the sums of a bin.
void SumTile::addEllipsoid(std::int64_t bin, std::uint32_t ellipsoid) {
  const ScreenBounds& b = scene_.ellipsoids.bounds[ellipsoid];
  const EllipsoidView& e = scene_.ellipsoids.views[ellipsoid];
  // The place relative to the tile's first pixel and the bin's first sample.
  const auto toColumn = float(column_ - e.column), toRow = float(row_ - e.row);
  const auto middleAhead = float(e.depth * middleUnit_ - double(bin) * kBinSamples);
  const int lastRow = std::min(b.lastRow - row_, rows_ - 1);
  const int lastColumn = std::min(b.lastColumn - column_, columns_ - 1);
  for (int row = std::max(0, b.firstRow - row_); row <= lastRow; ++row)
    for (int column = std::max(0, b.firstColumn - column_); column <= lastColumn; ++column) {
      const int pixel = row * kTileSide + column;
      if (!alive(pixel)) continue;
      const RaySpan span = spanOn(e.form, toColumn + float(column), toRow + float(row),
                                  scales_[pixel], float(e.depth), middleAhead);
      touched_[pixel] |= samplesFrom(span.first, span.last);
      float* sums = &sums_[std::size_t(pixel) * kBinSamples];
      for (int i = span.first; i <= span.last; ++i) sums[i] += valueAt(e.form, span, i);
    }
}

/// Adds the sums of a bin to a ray, and sets them to 0 for the next bin.
void SumTile::compositeRay(int pixel, double firstSample) {
  const float background = scene_.rule.background;
  float* sums = &sums_[std::size_t(pixel) * kBinSamples];
  for (std::uint32_t left = touched_[pixel]; left != 0; left &= left - 1) {
    const int sample = std::countr_zero(left);
    const float sum = std::exchange(sums[sample], 0.0f);
    const float value = scene_.voxelRule.settled(background + sum);
    const double number = firstSample + sample;
    if (value != background && alive(pixel) && clips_[pixel].has(number))
      scene_.rule.add(rays_[pixel], value,
                      sampleNumber(number, scene_.view.before / scene_.options.step));
  }
  touched_[pixel] = 0;
}

bool SumTile::anyAlive() const {
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      if (alive(row * kTileSide + column)) return true;
  return false;
}

void SumTile::copyTo(Picture& picture) const {
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      picture.set(column_ + column, row_ + row,
                  scene_.rule.finished(rays_[row * kTileSide + column]));
}

/// Draws one row of tiles. Only one row is listed at a time, which limits the memory of the lists.
void drawRowOfTiles(const SumScene& scene, int firstRow, Picture& picture) {
  const int tiles = sumTilesAlong(scene.options.resolution.width);
  // By tile: the ellipsoids whose bounds overlap it, in the order of the field.
  std::vector<std::vector<std::uint32_t>> lists(static_cast<std::size_t>(tiles));
  for (std::uint32_t e = 0; e < scene.ellipsoids.bounds.size(); ++e) {
    const ScreenBounds& b = scene.ellipsoids.bounds[e];
    if (b.lastRow < firstRow || b.firstRow >= firstRow + kTileSide) continue;
    for (int t = b.firstColumn / kTileSide; t <= b.lastColumn / kTileSide; ++t)
      lists[t].push_back(e);
  }
  parallelFor(0, tiles, [&](int t) {
    if (lists[t].empty()) return;
    checkCancelled(scene.options);
    SumTile tile(scene, t * kTileSide, firstRow);
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
  const SumScene scene{options, picture.view, ellipsoids,
                       sampleRule(options, picture.table.view(), field.background),
                       makeVoxelRule(field.background, voxels)};
  parallelFor(0, sumTilesAlong(options.resolution.height), [&](int row) {
    checkCancelled(options);
    drawRowOfTiles(scene, row * kTileSide, picture);
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
