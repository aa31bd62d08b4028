#include "convert/summable.h"

#include <algorithm>
#include <cmath>

namespace esvr::convert {

std::optional<Coord> tooLargeForSums(const SparseVolume& volume) {
  const auto isTooLarge = [background = volume.background](float value) {
    return std::abs(double(value) - background) > kLargestSummable;
  };
  const auto found = std::find_if(volume.values.begin(), volume.values.end(), isTooLarge);
  if (found == volume.values.end()) return std::nullopt;
  const auto place = std::size_t(found - volume.values.begin());
  return volume.brickCorner(place / kBrickVoxels) + voxelLocal(int(place % kBrickVoxels));
}

}  // namespace esvr::convert
