#pragma once
/// Marches a ray through a NanoVDB grid: the reference for pictures and speed. Samples near leaf
/// nodes are interpolated trilinearly; a region without leaves is crossed in one step, whose size
/// is that of the tree's empty node. The code is compiled for host and device.

#include <nanovdb/NanoVDB.h>
#if __has_include(<nanovdb/math/SampleFromVoxels.h>)  // OpenVDB 12 and up
#include <nanovdb/math/SampleFromVoxels.h>
#define ESVR_NANOVDB_MATH nanovdb::math
#else
#include <nanovdb/util/SampleFromVoxels.h>
#define ESVR_NANOVDB_MATH nanovdb
#endif

#include "esvr/vdb_io.h"
#include "render/brick_march.h"

namespace esvr {

/// The box of all places whose interpolation reads a voxel of a leaf; empty for a grid without
/// leaves.
[[nodiscard]] inline PlaceBox sampledBox(const NanoVolume& volume) {
  const Coord low = volume.voxels.min, high = volume.voxels.max;
  if (volume.voxels.empty()) return kNoPlaces;
  return {{low.x - 1.0, low.y - 1.0, low.z - 1.0}, {high.x + 1.0, high.y + 1.0, high.z + 1.0}};
}

/// Number of samples from a place to the first one that may read a voxel outside an empty node; 0
/// if the sample at the place already may. A cell reaches to the next voxel along each axis, so
/// only the cells at the upper faces of a node read voxels outside it.
ESVR_HD inline int samplesToLeaveNode(const FloatPlace& place, const FloatPlace& perVoxel,
                                      const nanovdb::Coord& at, std::uint32_t dim) {
  const int mask = ~(int(dim) - 1), side = int(dim) - 1;
  const Coord low{at[0] & mask, at[1] & mask, at[2] & mask};
  const bool within = at[0] < low.x + side && at[1] < low.y + side && at[2] < low.z + side;
  return within ? samplesToLeave(place, perVoxel, low, side) : 0;
}

/// The color of a pixel.
template <class Build>
ESVR_HD inline PixelColor marchNano(const nanovdb::NanoGrid<Build>& grid, const MarchScene& scene,
                                    int column, int row) {
  const auto accessor = grid.getAccessor();
  const auto sample = ESVR_NANOVDB_MATH::createSampler<1>(accessor);
  const MarchSamples samples = samplesOf(scene, column, row, SampleRange::all());
  RayProgress ray;
  for (int part = samples.start(ray.parts); part <= samples.lastPart && scene.rule.open(ray.ray);) {
    const FloatPlace at = samples.at(part);
    const nanovdb::Vec3f place(at.x, at.y, at.z);
    const nanovdb::Coord voxel = nanovdb::Coord::Floor(place);
    const bool isEmpty = ray.ray.last == RayState::kNone && !ray.parts.divided;
    if (isEmpty && accessor.probeLeaf(voxel) == nullptr) {
      const std::uint32_t dim = accessor.getDim(voxel, 0);
      if (const int skip = samplesToLeaveNode(at, samples.perVoxel, voxel, dim); skip > 0) {
        part += kSegmentParts * skip;
        continue;
      }
    }
    const float value = samples.inside(part) ? sample(place) : scene.rule.background;
    const SampleNumber number = samples.numberOf(part, ray.parts.apart());
    part = brick_march::addSample(scene.rule, {nullptr, {}, at, value, number}, part, ray,
                                  UnlitSamples{});
  }
  return scene.rule.finished(ray.ray);
}

}  // namespace esvr
