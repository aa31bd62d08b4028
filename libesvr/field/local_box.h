#pragma once
/// The part of a box that lies in one brick. The code is compiled for host and device.

#include <cstdint>

#include "esvr/coord.h"
#include "esvr/kernel.h"

namespace esvr {

/// The part of a box within the voxels 0 to `last` of a brick along each axis, counted from the
/// brick's first voxel. If it is empty, high is below low along an axis.
struct LocalBox {
  int low[3], high[3];

  [[nodiscard]] ESVR_HD bool contains(int x, int y, int z) const {
    return x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1] && z >= low[2] &&
           z <= high[2];
  }
};

/// \param corner  index coordinates of the brick's first voxel
/// \param last    the last voxel along each axis, for example kBrickSide - 1
ESVR_HD inline LocalBox localBox(const Box& box, const Coord& corner, int last) {
  const auto within = [last](std::int64_t place, int below, int above) {
    return place < below ? below : (place > last + above ? last + above : int(place));
  };
  const auto from = [&](std::int32_t at, std::int32_t first) {
    return within(std::int64_t(at) - first, 0, 1);
  };
  const auto to = [&](std::int32_t at, std::int32_t first) {
    return within(std::int64_t(at) - first, -1, 0);
  };
  return {{from(box.min.x, corner.x), from(box.min.y, corner.y), from(box.min.z, corner.z)},
          {to(box.max.x, corner.x), to(box.max.y, corner.y), to(box.max.z, corner.z)}};
}

}  // namespace esvr
