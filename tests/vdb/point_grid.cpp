#include "vdb/point_grid.h"

#include <openvdb/points/PointConversion.h>

namespace esvr::test {

openvdb::GridBase::Ptr pointGrid(const std::string& name) {
  namespace points = openvdb::points;
  const std::vector<openvdb::Vec3s> positions{{0, 0, 0}, {1, 2, 3}};
  const auto grid = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(
      positions, *openvdb::math::Transform::createLinearTransform(1.0));
  grid->setName(name);
  return grid;
}

}  // namespace esvr::test
