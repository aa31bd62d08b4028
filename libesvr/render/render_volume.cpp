#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "esvr/render.h"
#include "render/picture.h"
#include "render/ray_box.h"
#include "render/voxel_sampler.h"

namespace esvr {
namespace {

/// The first sample behind an empty brick. Because of rounding, a sample on the far face of the
/// brick may be visited twice, but it is never skipped.
double behindBrick(const Ray& ray, Coord brick, double sample, double step) {
  constexpr double kRounding = 1e-6;
  const Vec3 low{double(brick.x) * kBrickSide, double(brick.y) * kBrickSide,
                 double(brick.z) * kBrickSide};
  const Vec3 high = sum(low, {kBrickSide, kBrickSide, kBrickSide});
  return std::max(sample + 1.0, std::ceil(within(ray, {low, high}).end / step - kRounding));
}

class RayMarch {
 public:
  RayMarch(const SparseVolume& volume, const RenderOptions& options, const Picture& picture)
      : options_(options),
        picture_(picture),
        sampler_(volume),
        rule_(sampleRule(options, picture.table.view(), volume.background)),
        origin_{double(volume.origin.x), double(volume.origin.y), double(volume.origin.z)} {}

  [[nodiscard]] PixelColor operator()(int column, int row) const {
    RayState state;
    Ray ray = picture_.view.ray(column, row);
    const SampleRange clip = samplesIn(ray, clipOf(options_), options_.step);
    ray.origin = difference(ray.origin, origin_);
    const RayInterval t = within(ray, {sampler_.low(), sampler_.high()});
    const SampleRange range = samplesIn(t, options_.step).both(clip);
    for (double sample = range.first; range.has(sample) && rule_.open(state);)
      sample = advance(ray, sample, state);
    return rule_.finished(state);
  }

 private:
  /// Adds a sample to the ray. \return the number of the next sample to visit
  double advance(const Ray& ray, double sample, RayState& state) const {
    const Vec3 place = sum(ray.origin, scaled(ray.direction, sample * options_.step));
    const Cell cell = cellOf(place);
    const auto brick = brickOf(cell.voxel);
    const VoxelSampler::Corners* corners = sampler_.find(brick);
    if (corners == nullptr) return behindBrick(ray, brick, sample, options_.step);
    const float value = sampler_.interpolate(*corners, cell);
    if (value != rule_.background) rule_.add(state, value, sampleNumber(sample));
    return sample + 1.0;
  }

  const RenderOptions& options_;
  const Picture& picture_;
  VoxelSampler sampler_;
  SampleRule rule_;
  Vec3 origin_;
};

}  // namespace

Image renderVolume(const SparseVolume& volume, const RenderOptions& options) {
  Picture picture(options);
  if (volume.bricks.empty()) return picture.take();
  const RayMarch march(volume, options, picture);
  tbb::parallel_for(tbb::blocked_range<int>(0, options.resolution.height), [&](const auto& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row) {
      checkCancelled(options);
      for (int column = 0; column < options.resolution.width; ++column)
        picture.set(column, row, march(column, row));
    }
  });
  return picture.take();
}

}  // namespace esvr
