#include "fit/intensity_passes.h"

#include <algorithm>

#include "fit/cpu/cpu_intensity_passes.h"
#include "fit/cuda/make_cuda_intensity_passes.h"

namespace esvr {

std::unique_ptr<IntensityPasses> makeIntensityPasses(const IntensityTarget& target,
                                                     const Device& device) {
  if (device.kind == DeviceKind::kCuda) return makeCudaIntensityPasses(target, device);
  return std::make_unique<CpuIntensityPasses>(target);
}

std::vector<Coord> knownCorners(const IntensityTarget& target) {
  std::vector<Coord> corners(target.bricks.begin(), target.bricks.end());
  if (!target.restrictToBricks)
    for (std::size_t b = 0; b < target.source.brickCount(); ++b)
      corners.push_back(target.source.brickCorner(b));
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

const float* sourceValues(const SparseVolume& source, Coord corner) {
  const auto at = findBrick(source, brickOf(corner - source.origin));
  return at ? source.brickValues(*at).data() : nullptr;
}

}  // namespace esvr
