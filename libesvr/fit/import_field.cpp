#include "fit/import_field.h"

namespace esvr {

std::vector<Ellipsoid> importField(const Field& field, Coord origin, double scale) {
  std::vector<Ellipsoid> all;
  all.reserve(field.ellipsoidCount());
  for (const auto& chunk : field.chunks) {
    const Ellipsoids& e = chunk.ellipsoids;
    const Coord frame = chunk.origin - origin;
    for (std::size_t i = 0; i < e.size(); ++i)
      all.push_back({{frame.x + double(e.center[0][i]), frame.y + double(e.center[1][i]),
                      frame.z + double(e.center[2][i])},
                     unitFrame(e, i),
                     e.intensity[i] * scale});
  }
  return all;
}

}  // namespace esvr
