#pragma once
/// Marches a ray through a NanoVDB grid: trilinear samples where leaves are, and hierarchical steps
/// over nodes that are not there, as large as the tree says. Written once for host and device.

#include <nanovdb/NanoVDB.h>
#include <nanovdb/util/SampleFromVoxels.h>

#include "render/ray_box.h"
#include "render/sample_rule.h"

namespace esvr {

/// What all rays of a picture share.
struct NanoScene {
  View view;
  PlaceBox box;  ///< outside of it every sample is the background
  double step;
  ClipBox clip;
  SampleRule rule;
};

namespace nano_march {

using Place = nanovdb::Vec3f;

/// A ray's samples in the box: `first` is where the first one lies, so that float32 will do.
struct Samples {
  Place first, apart;
  float number;  ///< of the first, from the eye
  int count;
};

ESVR_HD inline Place placeOf(const Vec3& v) { return {float(v[0]), float(v[1]), float(v[2])}; }

ESVR_HD inline Samples samplesOf(const NanoScene& s, int column, int row) {
  const Ray ray = s.view.ray(column, row);
  const SampleRange range =
      samplesIn(within(ray, s.box), s.step).and_(samplesIn(ray, s.clip, s.step));
  if (!(range.first <= range.last)) return {Place(0.0f), Place(0.0f), 0.0f, 0};
  return {placeOf(sum(ray.origin, scaled(ray.direction, range.first * s.step))),
          placeOf(scaled(ray.direction, s.step)), float(range.first),
          int(range.last - range.first) + 1};
}

/// How many samples on the first one lies that may see a voxel outside of an empty node; 0 where
/// this one may. A node's cells but those on its upper faces have all corners within it.
ESVR_HD inline int samplesToLeave(const Place& place, const Place& apart, const nanovdb::Coord& at,
                                  std::uint32_t dim) {
  constexpr float kRounding = 1e-3f;
  float leave = 1e30f;
  for (int a = 0; a < 3; ++a) {
    const int low = at[a] & ~(int(dim) - 1), high = low + int(dim) - 1;
    if (at[a] >= high) return 0;
    const float way = (apart[a] > 0.0f ? float(high) : float(low)) - place[a];
    const float samples = apart[a] != 0.0f ? way / apart[a] : 1e30f;
    leave = samples < leave ? samples : leave;
  }
  const int whole = int(std::ceil(leave - kRounding));
  return whole > 1 ? whole : 1;
}

}  // namespace nano_march

template <class Build>
ESVR_HD inline PixelColor marchNano(const nanovdb::NanoGrid<Build>& grid, const NanoScene& scene,
                                    int column, int row) {
  using namespace nano_march;
  const auto accessor = grid.getAccessor();
  const auto sample = nanovdb::createSampler<1>(accessor);
  const Samples samples = samplesOf(scene, column, row);
  RayState ray;
  for (int i = 0; i < samples.count && scene.rule.open(ray);) {
    const Place place = samples.first + samples.apart * float(i);
    const nanovdb::Coord voxel = nanovdb::Coord::Floor(place);
    if (accessor.probeLeaf(voxel) == nullptr) {
      const std::uint32_t dim = accessor.getDim(voxel, 0);
      if (const int skip = samplesToLeave(place, samples.apart, voxel, dim); skip > 0) {
        i += skip;
        continue;
      }
    }
    const float value = sample(place);
    if (value != scene.rule.background) scene.rule.add(ray, value, samples.number + float(i));
    ++i;
  }
  return scene.rule.finished(ray);
}

}  // namespace esvr
