#pragma once
/// Everything that marching through voxels needs, whatever holds them; for host and device.

#include "render/ray_box.h"
#include "render/sample_rule.h"

namespace esvr {

/// The parameters that all rays of a picture share.
struct MarchScene {
  View view;
  PlaceBox box;  ///< outside of it every sample is the background
  double step;
  ClipBox clip;
  SampleRule rule;
};

struct FloatPlace {
  float x, y, z;
};

/// A ray's samples in the box: `first` is where the first one lies, so that float32 will do.
struct MarchSamples {
  FloatPlace first, apart;
  float number;  ///< the first sample's number, from the eye
  int count;

  [[nodiscard]] ESVR_HD FloatPlace at(int i) const {
    const float n = float(i);
    return {first.x + n * apart.x, first.y + n * apart.y, first.z + n * apart.z};
  }
};

ESVR_HD inline FloatPlace floatPlace(const Vec3& v) {
  return {float(v[0]), float(v[1]), float(v[2])};
}

/// \param wanted  samples to look at, at most
ESVR_HD inline MarchSamples samplesOf(const MarchScene& s, int column, int row,
                                      const SampleRange& wanted) {
  const Ray ray = s.view.ray(column, row);
  const SampleRange range =
      samplesIn(within(ray, s.box), s.step).both(samplesIn(ray, s.clip, s.step)).both(wanted);
  if (!(range.first <= range.last)) return {{0, 0, 0}, {0, 0, 0}, 0.0f, 0};
  return {floatPlace(sum(ray.origin, scaled(ray.direction, range.first * s.step))),
          floatPlace(scaled(ray.direction, s.step)), float(range.first),
          int(range.last - range.first) + 1};
}

namespace march {

ESVR_HD inline float samplesToFace(float place, float apart, int low, int high) {
  if (apart == 0.0f) return 1e30f;
  return ((apart > 0.0f ? float(high) : float(low)) - place) / apart;
}

/// How many samples on, one at least, the first lies that is not in an empty cube.
/// \param low, side  of the cube
ESVR_HD inline int samplesToLeave(const FloatPlace& p, const FloatPlace& apart, const Coord& low,
                                  int side) {
  constexpr float kRounding = 1e-3f;
  const float x = samplesToFace(p.x, apart.x, low.x, low.x + side);
  const float y = samplesToFace(p.y, apart.y, low.y, low.y + side);
  const float z = samplesToFace(p.z, apart.z, low.z, low.z + side);
  const float leave = x < y ? (x < z ? x : z) : (y < z ? y : z);
  const float whole = std::ceil(leave - kRounding);
  return whole > 1.0f ? (whole < 1e9f ? int(whole) : 1000000000) : 1;
}

}  // namespace march
}  // namespace esvr
