// Plan: files that OpenVDB 13.0.0 and its NanoVDB 32.9.0 wrote (openvdb13/make_files.cpp has what they hold) are read
// with every voxel as it was written: grids of half floats with every codec, files and streams of grids of several
// types, level sets, grids of vectors, and quantised grids. A file is converted without loss and written again.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "esvr/convert_file.h"
#include "esvr/grid_coding.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::filesystem::path at(const char* name) {
  return std::filesystem::path(ESVR_OPENVDB13_DIR) / name;
}

/// The value of a voxel in all grids but the level set; 0: it is not active.
float valueIn(Coord v) {
  const auto isInCube = [&](std::int32_t x, std::int32_t side) {
    return v.x >= x && v.x < x + side && v.y >= 0 && v.y < side && v.z >= 0 && v.z < side;
  };
  if (isInCube(64, 8)) return 0.5f;  // a tile
  if (!isInCube(0, 13)) return 0.0f;
  const auto from = [](std::int32_t a) { return std::abs(a - 6); };
  return std::max(float(13 - from(v.x) - from(v.y) - from(v.z)) / 16.0f, 0.0f);
}

constexpr std::uint64_t kActiveVoxels = 1749 + 512;  // of the grids, and of their tile

/// \param factor  of the value; 1, or another one for a component of vectors
void expectItsVoxels(const SparseVolume& volume, float factor = 1.0f, float tolerance = 0.0f) {
  EXPECT_EQ(volume.background, 0.0f);
  EXPECT_EQ(activeVoxelCount(volume), kActiveVoxels);
  for (std::int32_t x = -1; x < 73; ++x)
    for (std::int32_t y = -1; y < 14; ++y)
      for (std::int32_t z = -1; z < 14; ++z)
        ASSERT_NEAR(valueAt(volume, {x, y, z}), factor * valueIn({x, y, z}), tolerance)
            << x << ' ' << y << ' ' << z;
}

void expectItsVectors(const VectorGrid& grid) {
  EXPECT_EQ(grid.descriptor.gridClass, GridClass::kStaggered);
  expectItsVoxels(grid.components[0]);
  expectItsVoxels(grid.components[1], -1.0f);
  expectItsVoxels(grid.components[2], 2.0f);
}

/// A ball of radius 6 around (8, 8, 8), in a band of 3 voxels.
void expectTheBall(const VolumeGrid& grid) {
  EXPECT_EQ(grid.descriptor.gridClass, GridClass::kLevelSet);
  EXPECT_EQ(grid.descriptor.background, 3.0);
  for (std::int32_t x = 0; x <= 16; ++x)
    for (std::int32_t y = 0; y <= 16; ++y) {
      const double distance = std::hypot(x - 8.0, y - 8.0) - 6.0;
      ASSERT_NEAR(valueAt(grid.volume, {x, y, 8}), std::clamp(distance, -3.0, 3.0), 1e-5);
    }
}

/// The value types of a file's grids, with "h" for those that are saved as half.
std::vector<std::string> typesIn(const char* name) {
  std::vector<std::string> types;
  for (const GridSummary& grid : inspectVdb(at(name)).grids)
    types.push_back(grid.valueType + (grid.savedAsHalf ? " h" : ""));
  return types;
}

TEST(OpenVdb13, FilesAreRead) {
  EXPECT_THAT(typesIn("grids.vdb"),
              ElementsAre("float h", "float h", "double", "vec3s", "bool", "float"));
  for (const char* name : {"density[0]", "density[1]", "temperature"}) {
    const VolumeGrid grid = readGrid(at("grids.vdb"), name);
    expectItsVoxels(grid.volume);
    EXPECT_EQ(grid.descriptor.gridClass, GridClass::kFogVolume);
    EXPECT_EQ(grid.descriptor.transform.mapType, "UniformScaleMap");
  }
  EXPECT_EQ(readGrid(at("grids.vdb"), "density[1]").descriptor.valueType, ValueType::kHalf);
  expectItsVectors(readVector(at("grids.vdb"), "vel"));
  expectTheBall(readGrid(at("grids.vdb"), "surface"));
}

TEST(OpenVdb13, GridsOfHalfFloatsAreReadWithEveryCodec) {
  for (const char* name : {"half_mask.vdb", "half_zip.vdb", "half_blosc.vdb"}) {
    EXPECT_THAT(typesIn(name), ElementsAre("float h"));
    expectItsVoxels(readGrid(at(name), "density").volume);
  }
}

TEST(OpenVdb13, StreamsAreRead) {
  EXPECT_THAT(typesIn("stream.vdb"), ElementsAre("float", "float h", "vec3s"));
  expectItsVoxels(readGrid(at("stream.vdb"), "smoke").volume);
  expectItsVoxels(readGrid(at("stream.vdb"), "density").volume);
  expectItsVectors(readVector(at("stream.vdb"), "vel"));
}

TEST(OpenVdb13, FilesAreConvertedWithoutLossAndWrittenAgain) {
  const test::TemporaryFolder folder;
  FileOptions options;
  options.convert.goal = LosslessGoal{};
  const EsvrFile file = convertGrids(readSources(at("grids.vdb"), true), options).file;
  ASSERT_EQ(file.carried.size(), 2u);  // doubles and bools
  std::vector<VolumeGrid> grids;
  for (const StoredGrid& grid : file.grids)
    grids.push_back({.descriptor = grid.descriptor, .volume = decodeGrid(grid)});
  std::vector<GridToWrite> all;
  for (const VolumeGrid& grid : grids) all.emplace_back(&grid);
  for (const CarriedGrid& grid : file.carried) all.emplace_back(&grid);
  writeGrids(folder / "out.vdb", file.metadata, all);
  for (const char* name : {"density[0]", "density[1]", "temperature", "vel.x"})
    expectItsVoxels(readGrid(folder / "out.vdb", name).volume);
  expectTheBall(readGrid(folder / "out.vdb", "surface"));
  // OpenVDB itself finds the carried grids, whatever its version.
  const auto flags =
      openvdb::gridPtrCast<openvdb::BoolGrid>(test::load(folder / "out.vdb", "flags"));
  ASSERT_TRUE(flags);
  EXPECT_EQ(flags->activeVoxelCount(), kActiveVoxels);
  EXPECT_TRUE(flags->tree().getValue({6, 6, 6}));
}

TEST(NanoVdb32_9, FilesAreRead) {
  EXPECT_THAT(typesIn("grids.nvdb"), ElementsAre("float", "vec3s", "double", "float", "onindex"));
  expectItsVoxels(readGrid(at("grids.nvdb"), "density[0]").volume);
  expectItsVoxels(readGrid(at("grids.nvdb"), "temperature").volume);
  expectItsVectors(readVector(at("grids.nvdb"), "vel"));
  expectTheBall(readGrid(at("grids.nvdb"), "surface"));
  EXPECT_THAT(inspectVdb(at("grids.nvdb")).grids[4].skipReason, HasSubstr("onindex"));
}

TEST(NanoVdb32_9, QuantisedGridsOfOneHandleAreRead) {
  EXPECT_THAT(typesIn("quantised.nvdb"), ElementsAre("fp4", "fp8", "fp16", "fpn"));
  // Half a step of a range of at most 13/16 per leaf; fpn has the tolerance of fogs.
  const double steps[] = {15, 255, 65535};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::string name = "density[" + std::to_string(i) + ']';
    const double tolerance = i < 3 ? 0.5 * 13 / 16 / steps[i] : 0.01;
    expectItsVoxels(readGrid(at("quantised.nvdb"), name).volume, 1.0f, float(tolerance + 1e-6));
  }
}

}  // namespace
}  // namespace esvr
