#pragma once
/// The part of a ray that lies in a box. The code is compiled for host and device.

#include <cmath>
#include <cstdint>
#include <limits>

#include "esvr/render.h"
#include "render/view.h"

namespace esvr {

/// An interval of distances along a ray; empty if begin > end.
struct RayInterval {
  double begin, end;
};

/// The part of a ray between two planes perpendicular to an axis.
ESVR_HD inline RayInterval slab(double origin, double direction, double low, double high) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  if (direction == 0.0)
    return origin >= low && origin <= high ? RayInterval{-kAll, kAll} : RayInterval{kAll, -kAll};
  const double a = (low - origin) / direction, b = (high - origin) / direction;
  return a < b ? RayInterval{a, b} : RayInterval{b, a};
}

/// The part of a ray that lies in a box and not behind the ray's origin.
ESVR_HD inline RayInterval within(const Ray& ray, const PlaceBox& box) {
  RayInterval t{0.0, std::numeric_limits<double>::infinity()};
  for (int a = 0; a < 3; ++a) {
    const RayInterval s = slab(ray.origin[a], ray.direction[a], box.low[a], box.high[a]);
    t.begin = s.begin > t.begin ? s.begin : t.begin;
    t.end = s.end < t.end ? s.end : t.end;
  }
  return t;
}

/// The largest number of samples that a ray may have in a volume. checkRayLength() (scene_depth.h)
/// refuses longer ones, and no march visits more samples, whatever rounding makes of a ray's ends.
inline constexpr std::int64_t kMostRaySamples = std::int64_t{1} << 24;

/// A range of a ray's samples. Sample n lies n steps from the eye.
struct SampleRange {
  double first, last;

  ESVR_HD static SampleRange all() { return {0.0, std::numeric_limits<double>::infinity()}; }

  [[nodiscard]] ESVR_HD bool has(double number) const { return number >= first && number <= last; }
  [[nodiscard]] ESVR_HD SampleRange both(const SampleRange& other) const {
    return {other.first > first ? other.first : first, other.last < last ? other.last : last};
  }
  /// The number of samples from the first one to a later one, at most kMostRaySamples.
  [[nodiscard]] ESVR_HD int countTo(double number) const {
    const double count = number - first;
    if (!(count > 0.0)) return 0;
    return count < double(kMostRaySamples) ? int(count) : int(kMostRaySamples);
  }
};

ESVR_HD inline SampleRange samplesIn(const RayInterval& t, double step) {
  return {std::ceil(t.begin / step), std::floor(t.end / step)};
}

/// An optional clip box. If it is not given, all places are inside.
struct ClipBox {
  PlaceBox box;
  bool given;
};
[[nodiscard]] inline ClipBox clipOf(const RenderOptions& options) {
  return {options.clip.value_or(PlaceBox{}), options.clip.has_value()};
}
ESVR_HD inline SampleRange samplesIn(const Ray& ray, const ClipBox& clip, double step) {
  return clip.given ? samplesIn(within(ray, clip.box), step) : SampleRange::all();
}

}  // namespace esvr
