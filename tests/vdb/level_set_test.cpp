// Plan: level sets that OpenVDB made are read, converted, decoded, written and loaded again. The sign
// of every voxel in a box around the surface must be that of the first tree, in leaves and in tiles.
// This is tested for spheres of several half widths and voxel sizes, and with real files for several
// goals. At a fiftieth of the bytes of the VDB file, short fits of spheres moved
// the surface by 0.16 to 0.24 voxels (kDraftDistance leaves room for other machines).
//
// The distance of meshes is known for a sphere that moved by whole voxels: the meshes are the same but
// for the move, so that no vertex is farther away than its own copy, and the vertices at the pole are
// as far away as the move, less the height of a polygon: with edges below 2 voxels, it is 1 / (2 r)
// in a sphere of radius r.

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <limits>

#include "esvr/encode.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

using openvdb::FloatGrid;

constexpr double kRadius = 20.0;         // voxels
constexpr double kDraftDistance = 0.35;  // voxels
constexpr double kRounding = 1e-4;       // of values and points in float32, voxels

struct Sphere {
  float voxelSize = 1.0f, halfWidth = 3.0f;
  double radius = kRadius;
  float center = 0.0f;  ///< x, in voxels
};

FloatGrid::Ptr sphereOf(const Sphere& s) {
  auto grid = openvdb::tools::createLevelSetSphere<FloatGrid>(
      float(s.radius) * s.voxelSize, openvdb::Vec3f(s.center + 0.3f, 0.3f, 0.3f) * s.voxelSize,
      s.voxelSize, s.halfWidth);
  grid->setName("surface");
  return grid;
}

class LevelSetFile : public testing::Test {
 protected:
  [[nodiscard]] VolumeGrid readBack(const FloatGrid::Ptr& grid) const {
    test::save(folder_ / "in.vdb", {grid});
    return readGrid(folder_ / "in.vdb", grid->getName());
  }

  /// The tree that a reader of the converted file writes.
  [[nodiscard]] FloatGrid::Ptr throughAFile(const VolumeGrid& grid) const {
    writeGrids(folder_ / "out.vdb", {}, {&grid, 1}, {.overwrite = true});
    return openvdb::gridPtrCast<FloatGrid>(test::load(folder_ / "out.vdb", grid.descriptor.name));
  }
  [[nodiscard]] std::uint64_t bytesIn() const {
    return std::filesystem::file_size(folder_ / "in.vdb");
  }

 private:
  test::TemporaryFolder folder_;
};

VolumeGrid converted(const VolumeGrid& source, const Goal& goal) {
  ConvertOptions options;
  options.goal = goal;
  options.fit.preset = Preset::kDraft;
  const Conversion made = convertVolume({source.descriptor, source.volume}, options);
  return {.descriptor = source.descriptor, .volume = decodeGrid(made.grid)};
}

/// Voxels of the box around the active voxels, widened by a leaf, whose signs differ.
std::uint64_t signErrors(const FloatGrid& a, const FloatGrid& b) {
  openvdb::CoordBBox box = a.evalActiveVoxelBoundingBox();
  box.expand(kBrickSide);
  const auto first = a.getConstAccessor(), second = b.getConstAccessor();
  std::uint64_t errors = 0;
  for (auto voxel = box.begin(); voxel; ++voxel)
    errors += (first.getValue(*voxel) < 0.0f) != (second.getValue(*voxel) < 0.0f);
  return errors;
}

TEST_F(LevelSetFile, OfASphereKeepsAllSigns) {
  for (const Sphere& sphere : {Sphere{}, Sphere{1.0f, 1.5f}, Sphere{0.01f}, Sphere{100.0f}}) {
    const auto grid = sphereOf(sphere);
    const VolumeGrid source = readBack(grid);
    ASSERT_TRUE(isNarrowBand(source.descriptor, source.volume));
    for (const Goal& goal : {Goal{BoundGoal{0.05, true}}, Goal{LosslessGoal{}}})
      EXPECT_EQ(signErrors(*grid, *throughAFile(converted(source, goal))), 0u);
  }
}

TEST_F(LevelSetFile, SlowOfASphereAtAFiftiethKeepsItsSigns) {
  const auto grid = sphereOf({.voxelSize = 0.01f, .radius = 30.0});
  const VolumeGrid source = readBack(grid);
  const VolumeGrid decoded = converted(source, SizeGoal{bytesIn() / 50});
  EXPECT_EQ(signErrors(*grid, *throughAFile(decoded)), 0u);
  const MeshDistance distance = meshDistance(source, decoded);
  EXPECT_LE(distance.voxels, kDraftDistance);
  EXPECT_NEAR(distance.world, 0.01 * distance.voxels, 1e-6);
}

TEST_F(LevelSetFile, SlowRealFileOfACubeKeepsAllSigns) {
  ESVR_NEEDS_DATA();
  const auto path = test::dataDir() / "cube_levelset.vdb";
  const VolumeGrid source = readGrid(path, "ls_cube");
  const auto grid = openvdb::gridPtrCast<FloatGrid>(test::load(path, "ls_cube"));
  for (const Goal& goal : {Goal{SizeGoal{std::filesystem::file_size(path) / 50}},
                           Goal{PsnrGoal{30.0}}, Goal{BoundGoal{0.01, true}}, Goal{PresetGoal{}}})
    EXPECT_EQ(signErrors(*grid, *throughAFile(converted(source, goal))), 0u);
}

TEST(MeshDistance, SlowOfASphereThatMovedIsTheLengthOfItsMove) {
  const test::TemporaryFolder folder;
  const auto gridOf = [&](const Sphere& sphere) {
    test::save(folder / "sphere.vdb", {sphereOf(sphere)});
    return readGrid(folder / "sphere.vdb", "surface");
  };
  const VolumeGrid sphere = gridOf({.voxelSize = 0.5f});
  EXPECT_EQ(meshDistance(sphere, sphere).voxels, 0.0);
  // Below and above the width within which voxels know their nearest polygon.
  for (const double move : {1.0, 6.0}) {
    const VolumeGrid moved = gridOf({.voxelSize = 0.5f, .center = float(move)});
    for (const MeshDistance& distance :
         {meshDistance(sphere, moved), meshDistance(moved, sphere)}) {
      EXPECT_LE(distance.voxels, move + kRounding);
      EXPECT_GE(distance.voxels, move - 1.0 / (2.0 * kRadius));
      EXPECT_NEAR(distance.world, 0.5 * distance.voxels, kRounding);
    }
  }
}

TEST(MeshDistance, ToNoSurfaceIsInfinite) {
  const test::TemporaryFolder folder;
  test::save(folder / "sphere.vdb", {sphereOf({})});
  const VolumeGrid sphere = readGrid(folder / "sphere.vdb", "surface");
  VolumeGrid none = sphere;
  for (float& v : none.volume.values) v = std::abs(v);
  EXPECT_EQ(meshDistance(sphere, none).voxels, std::numeric_limits<double>::infinity());
  EXPECT_EQ(meshDistance(none, none).voxels, 0.0);
}

/// A file without loss keeps the signs of inactive voxels, also where no active voxels separate the sides.
TEST_F(LevelSetFile, WithAHoleInLeavesKeepsAllSigns) {
  const auto grid = sphereOf({.radius = 10.0});
  openvdb::CoordBBox hole({5, -2, -2}, {13, 2, 2});
  for (auto voxel = hole.begin(); voxel; ++voxel)
    grid->tree().setValueOff(*voxel, grid->background());
  const VolumeGrid source = readBack(grid);
  ASSERT_TRUE(isNarrowBand(source.descriptor, source.volume));
  EXPECT_EQ(source.inactive.count(), 0u);
  EXPECT_EQ(signErrors(*grid, *throughAFile(converted(source, LosslessGoal{}))), 0u);
}

TEST_F(LevelSetFile, WithAHoleIsWrittenWithoutAFloodFill) {
  const auto grid = sphereOf({});
  grid->tree().root().touchLeaf(openvdb::Coord(0, 0, 20))->setValuesOff();
  const VolumeGrid source = readBack(grid);
  ASSERT_FALSE(EmptySigns(source.volume).agree());
  const auto back = throughAFile(source);
  EXPECT_EQ(back->tree().getValue({0, 0, 0}), back->background());
  EXPECT_EQ(back->activeVoxelCount(), grid->activeVoxelCount());
}

}  // namespace
}  // namespace esvr
