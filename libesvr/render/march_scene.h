#pragma once
/// The parts of ray marching that do not depend on how voxels are stored. The code is compiled for
/// host and device.

#include "render/ray_box.h"
#include "render/sample_rule.h"
#include "render/shading.h"

namespace esvr {

/// The parameters that all rays of a picture share.
struct MarchScene {
  View view;
  PlaceBox box;  ///< every sample outside this box is the background
  double step;
  ClipBox clip;
  SampleRule rule;
  bool isShaded = false;
  LightRule light{};  ///< used if isShaded
};

/// The samples of a ray inside the box, of which `begin` to `end` - 1 are wanted. Sample i lies at
/// first + i apart. It is computed from the first sample in the box and not from the eye, so that
/// float32 is precise enough, and not from the first one that is wanted, so that it does not depend
/// on what is wanted.
struct MarchSamples {
  FloatPlace first, apart;
  FloatPlace perVoxel;  ///< samples in a step of a voxel along each axis; 0 where they do not move
  float number;         ///< number of sample 0, counted from the camera's eye
  int begin, end;

  [[nodiscard]] ESVR_HD FloatPlace at(int i) const {
    const float n = float(i);
    return {first.x + n * apart.x, first.y + n * apart.y, first.z + n * apart.z};
  }
  [[nodiscard]] ESVR_HD SampleNumber numberOf(int i) const {
    return {number + float(i), std::uint32_t(i)};
  }
};

ESVR_HD inline float samplesPerVoxel(float apart) {
  constexpr float kStill = 1e-30f;  // so slow that no ray is long enough to leave a brick
  return std::fabs(apart) < kStill ? 0.0f : 1.0f / apart;
}

/// The samples of a ray in the box and in the clip box.
ESVR_HD inline SampleRange samplesInScene(const MarchScene& s, const Ray& ray) {
  return samplesIn(within(ray, s.box), s.step).both(samplesIn(ray, s.clip, s.step));
}

/// \param wanted  further limit on the range of samples
ESVR_HD inline MarchSamples samplesOf(const MarchScene& s, int column, int row,
                                      const SampleRange& wanted) {
  const Ray ray = s.view.ray(column, row);
  const SampleRange range = samplesInScene(s, ray);
  const SampleRange both = range.both(wanted);
  if (!(both.first <= both.last)) return {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0.0f, 0, 0};
  const FloatPlace apart = floatPlace(scaled(ray.direction, s.step));
  return {floatPlace(sum(ray.origin, scaled(ray.direction, range.first * s.step))),
          apart,
          {samplesPerVoxel(apart.x), samplesPerVoxel(apart.y), samplesPerVoxel(apart.z)},
          float(range.first + s.view.before / s.step),
          range.countTo(both.first),
          range.countTo(both.last) + 1};
}

namespace march {

ESVR_HD inline float samplesToFace(float place, float perVoxel, int low, int high) {
  if (perVoxel == 0.0f) return 1e30f;
  return ((perVoxel > 0.0f ? float(high) : float(low)) - place) * perVoxel;
}

/// Number of samples from a place to the first one outside an empty cube, at least 1.
/// \param low, side  lowest corner and side of the cube
ESVR_HD inline int samplesToLeave(const FloatPlace& p, const FloatPlace& perVoxel, const Coord& low,
                                  int side) {
  constexpr float kRounding = 1e-3f;
  const float x = samplesToFace(p.x, perVoxel.x, low.x, low.x + side);
  const float y = samplesToFace(p.y, perVoxel.y, low.y, low.y + side);
  const float z = samplesToFace(p.z, perVoxel.z, low.z, low.z + side);
  const float leave = x < y ? (x < z ? x : z) : (y < z ? y : z);
  const float whole = std::ceil(leave - kRounding);
  return whole > 1.0f ? (whole < 1e9f ? int(whole) : 1000000000) : 1;
}

}  // namespace march
}  // namespace esvr
