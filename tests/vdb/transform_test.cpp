/// Plan: a grid is stored with every map that OpenVDB has. The bytes of the map are read unchanged.
/// OpenVDB reads the same map of the same type from the written file. The affine matrix agrees with
/// OpenVDB's indexToWorld in float64, up to rounding.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/math/Maps.h>

#include <limits>
#include <sstream>

#include "esvr/error.h"
#include "vdb/made_files.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

namespace math = openvdb::math;
using openvdb::Vec3d;

struct NamedMap {
  const char* name;
  math::MapBase::Ptr map;
};
std::ostream& operator<<(std::ostream& out, const NamedMap& map) { return out << map.name; }

math::Mat4d sheared() {
  math::Mat4d m(math::rotation<math::Mat4d>(Vec3d(1, 2, 3).unit(), 0.7));
  m.postScale(Vec3d(0.3, 2.0, 1e-3));
  m.postShear(math::X_AXIS, math::Y_AXIS, 0.4);
  m.postTranslate(Vec3d(1e6, -3.25, 0.1));
  return m;
}

template <class Map, class... Args>
NamedMap make(Args&&... args) {
  openvdb::initialize();
  static const std::string name = Map::mapType();
  return {name.c_str(), std::make_shared<Map>(std::forward<Args>(args)...)};
}

std::vector<NamedMap> everyMap() {
  const openvdb::BBoxd box(Vec3d(0), Vec3d(100, 80, 60));
  return {
      make<math::ScaleMap>(Vec3d(0.1, -2.0, 3.0)), make<math::UniformScaleMap>(0.1),
      make<math::TranslationMap>(Vec3d(0.1, 0.2, 0.3)),
      make<math::ScaleTranslateMap>(Vec3d(0.1, 0.2, 0.3), Vec3d(4, 5, 6)),
      make<math::UniformScaleTranslateMap>(1.0 / 3.0, Vec3d(4, 5, 6)),
      make<math::UnitaryMap>(Vec3d(1, 1, 0).unit(), 0.3), make<math::AffineMap>(sheared()),
      // OpenVDB could simplify this map. It must keep its type.
      make<math::AffineMap>(math::Mat4d::identity()),
      make<math::NonlinearFrustumMap>(box, 0.4, 2.5),
      make<math::NonlinearFrustumMap>(box, 0.4, 2.5, std::make_shared<math::AffineMap>(sheared()))};
}

/// A grid with exactly this map, which the constructor of Transform would simplify.
openvdb::FloatGrid::Ptr gridUnder(const math::MapBase& map) {
  std::stringstream stream(std::ios::in | std::ios::out | std::ios::binary);
  openvdb::io::setCurrentVersion(stream);
  openvdb::writeString(stream, map.type());
  map.write(stream);
  auto grid = test::smallGrid();
  grid->transform().read(stream);
  return grid;
}

class EveryMap : public testing::TestWithParam<NamedMap> {
 protected:
  test::TemporaryFolder directory_;
};

TEST_P(EveryMap, ComesBackFromVdbVerbatim) {
  const math::MapBase& map = *GetParam().map;
  test::save(directory_ / "in.vdb", {gridUnder(map)});
  const auto grid = readGrid(directory_ / "in.vdb", "density");
  EXPECT_EQ(grid.descriptor.transform.mapType, map.type());

  writeGrids(directory_ / "out.vdb", {}, {&grid, 1});
  const auto back = test::load(directory_ / "out.vdb", "density");
  EXPECT_EQ(back->transform().mapType(), map.type());
  EXPECT_TRUE(back->transform().baseMap()->isEqual(map));
  EXPECT_EQ(readGrid(directory_ / "out.vdb", "density").descriptor, grid.descriptor);
}

TEST_P(EveryMap, HasItsAffineMatrixWhereItIsLinear) {
  const math::MapBase& map = *GetParam().map;
  test::save(directory_ / "in.vdb", {gridUnder(map)});
  const auto affine = readGrid(directory_ / "in.vdb", "density").descriptor.transform.affine;
  ASSERT_EQ(affine.has_value(), map.isLinear());
  if (!affine) return;
  const Vec3d voxel(3, -5, 1000);
  const Vec3d world = map.applyMap(voxel);
  for (int c = 0; c < 3; ++c) {
    double sum = (*affine)[std::size_t(12 + c)], size = std::abs(sum);
    for (int r = 0; r < 3; ++r) {
      const double term = voxel[r] * (*affine)[std::size_t(4 * r + c)];
      sum += term;
      size += std::abs(term);
    }
    // Both sides have four terms, each of which is rounded once and added once.
    EXPECT_NEAR(sum, world[c], 16 * std::numeric_limits<double>::epsilon() * size);
  }
}

TEST_P(EveryMap, ComesBackFromNvdbAsTheSameAffineMatrix) {
  const math::MapBase& map = *GetParam().map;
  test::save(directory_ / "in.vdb", {gridUnder(map)});
  const auto grid = readGrid(directory_ / "in.vdb", "density");
  if (!map.isLinear()) {
    EXPECT_THROW(writeGrids(directory_ / "out.nvdb", {}, {&grid, 1}), UsageError);
    return;
  }
  writeGrids(directory_ / "out.nvdb", {}, {&grid, 1});
  EXPECT_EQ(readGrid(directory_ / "out.nvdb", "density").descriptor.transform.affine,
            grid.descriptor.transform.affine);
}

INSTANTIATE_TEST_SUITE_P(OpenVdb, EveryMap, testing::ValuesIn(everyMap()));

TEST(UniformTransform, IsWhatOpenVdbMakes) {
  const auto transform = uniformTransform(0.1);
  EXPECT_EQ(transform.mapType, "UniformScaleMap");
  auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  grid.descriptor.transform = transform;
  const test::TemporaryFolder directory;
  writeGrids(directory / "out.vdb", {}, {&grid, 1});
  EXPECT_TRUE(test::load(directory / "out.vdb", "density")->transform() ==
              *math::Transform::createLinearTransform(0.1));
}

TEST(UniformTransform, RefusesInvalidSizes) {
  for (const double size : {0.0, -1.0, std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW((void)uniformTransform(size), UsageError) << size;
}

TEST(AffineTransform, KeepsTheMatrix) {
  std::array<double, 16> matrix;
  std::copy_n(sheared().asPointer(), 16, matrix.begin());
  const auto transform = affineTransform(matrix);
  EXPECT_EQ(transform.mapType, "AffineMap");
  EXPECT_EQ(transform.affine, matrix);
}

TEST(AffineTransform, RefusesMatricesThatAreNotAffineOrSingular) {
  std::array<double, 16> singular{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  EXPECT_THROW((void)affineTransform(singular), UsageError);
  std::array<double, 16> projective{1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_THROW((void)affineTransform(projective), UsageError);
  std::array<double, 16> nan{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  nan[5] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)affineTransform(nan), UsageError);
}

}  // namespace
}  // namespace esvr
