#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <limits>

#include "esvr/render.h"
#include "render/picture.h"
#include "render/voxel_sampler.h"

namespace esvr {
namespace {

struct Interval {
  double begin, end;
};

/// Where a ray lies between two planes perpendicular to an axis.
Interval slab(double origin, double direction, double low, double high) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  if (direction == 0.0)
    return origin >= low && origin <= high ? Interval{-kAll, kAll} : Interval{kAll, -kAll};
  const double a = (low - origin) / direction, b = (high - origin) / direction;
  return {std::min(a, b), std::max(a, b)};
}

Interval within(const Ray& ray, const Vec3& low, const Vec3& high) {
  Interval t{0.0, std::numeric_limits<double>::infinity()};
  for (int a = 0; a < 3; ++a) {
    const Interval s = slab(ray.origin[a], ray.direction[a], low[a], high[a]);
    t = {std::max(t.begin, s.begin), std::min(t.end, s.end)};
  }
  return t;
}

/// The first sample behind a brick that has nothing. Rounding must not lose a sample that lies on
/// the brick's far side: it may be looked at twice instead.
double behindBrick(const Ray& ray, Coord brick, double sample, double step) {
  constexpr double kRounding = 1e-6;
  const Vec3 low{double(brick.x) * kBrickSide, double(brick.y) * kBrickSide,
                 double(brick.z) * kBrickSide};
  const Vec3 high = sum(low, {kBrickSide, kBrickSide, kBrickSide});
  return std::max(sample + 1.0, std::ceil(within(ray, low, high).end / step - kRounding));
}

class RayMarch {
 public:
  RayMarch(const SparseVolume& volume, const RenderOptions& options, const Picture& picture)
      : options_(options),
        picture_(picture),
        sampler_(volume),
        background_(volume.background),
        origin_{double(volume.origin.x), double(volume.origin.y), double(volume.origin.z)} {}

  [[nodiscard]] RayState operator()(int column, int row) const {
    RayState state;
    Ray ray = picture_.view.ray(column, row);
    ray.origin = difference(ray.origin, origin_);
    const Interval t = within(ray, sampler_.low(), sampler_.high());
    if (t.begin > t.end) return state;
    const double end = std::floor(t.end / options_.step);
    double sample = std::ceil(t.begin / options_.step);
    while (sample <= end && !(state.transmittance < options_.minTransmittance))
      sample = advance(ray, sample, state);
    return state;
  }

 private:
  /// Takes a sample and \return the next one to take.
  double advance(const Ray& ray, double sample, RayState& state) const {
    const Vec3 place = sum(ray.origin, scaled(ray.direction, sample * options_.step));
    const Cell cell = cellOf(place);
    const auto brick = brickOf(cell.voxel);
    const VoxelSampler::Corners* corners = sampler_.find(brick);
    if (corners == nullptr) return behindBrick(ray, brick, sample, options_.step);
    const float value = sampler_.interpolate(*corners, cell);
    if (value != background_) state.add(picture_.table(value));
    return sample + 1.0;
  }

  const RenderOptions& options_;
  const Picture& picture_;
  VoxelSampler sampler_;
  float background_;
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
