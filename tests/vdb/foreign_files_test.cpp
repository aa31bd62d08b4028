// Plan: files that OpenVDB 13.0.0 and its NanoVDB 32.9.0 wrote (openvdb13/make_files.cpp has what they hold) are read
// with every voxel as it was written: grids of half floats with every codec, files and streams of grids of several
// types, level sets, grids of vectors, and quantised grids. A file is converted without loss and written again.
//
// Grids of the type HalfGrid, which OpenVDB 13 has, are written by the OpenVDB that is there. They are read as
// the same grid of floats that is saved as half, with every packing, and refused where they are cut.
//
// Every real file is read as its row in the data folder's README states. Counts and boxes agree with the statistics that
// its writer stored. Written again, it is the same grid bit by bit, including transform and metadata.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "esvr/convert_file.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"
#include "vdb/foreign_grids.h"
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

// ---- Half grids

/// A grid with a background, leaves, active and inactive tiles of two levels, and inactive values. All values
/// are exact in half.
template <class Grid>
typename Grid::Ptr gridOfHalfs() {
  using Value = typename Grid::ValueType;
  openvdb::initialize();
  auto grid = Grid::create(Value(0.5f));
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  for (int i = 0; i < 200; ++i)
    grid->tree().setValueOn({i % 20 - 10, i / 20, i % 7}, Value(float(i % 13) / 4.0f));
  grid->tree().setValueOff({3, 3, 6}, Value(8.0f));
  grid->tree().addTile(1, {64, 0, 0}, Value(0.75f), true);
  grid->tree().addTile(2, {1024, 0, 0}, Value(2.0f), true);
  grid->tree().addTile(1, {128, 0, 0}, Value(4.0f), false);
  return grid;
}

/// Writes a HalfGrid as OpenVDB 13 does. Older versions have its type, but no name for it, and store the same
/// bytes but for the version of the format.
void saveHalfGrid(const std::filesystem::path& path, std::uint32_t compression) {
  constexpr std::size_t kPlaceOfVersion = 8;
  test::saveCompressed(path, {gridOfHalfs<openvdb::Grid<vdb::HalfTree>>()}, compression);
  auto bytes = test::bytesIn(path);
  bytes[kPlaceOfVersion] = std::byte(225);
  test::writeBytes(path, bytes);
}

class HalfGrids : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path at(const char* name) const { return folder_ / name; }
  test::TemporaryFolder folder_;
};

TEST_F(HalfGrids, AreReadAsFloatsThatAreSavedAsHalf) {
  namespace io = openvdb::io;
  const auto floats = gridOfHalfs<openvdb::FloatGrid>();
  floats->setSaveFloatAsHalf(true);
  test::save(at("floats.vdb"), {floats});
  const VolumeGrid expected = readGrid(at("floats.vdb"), "density");
  for (const std::uint32_t mask :
       {std::uint32_t(io::COMPRESS_NONE), std::uint32_t(io::COMPRESS_ACTIVE_MASK)})
    for (const std::uint32_t codec : {io::COMPRESS_NONE, io::COMPRESS_ZIP, io::COMPRESS_BLOSC}) {
      saveHalfGrid(at("in.vdb"), mask | codec);
      const GridSummary listed = inspectVdb(at("in.vdb")).grids.front();
      EXPECT_EQ(listed.valueType, "float");
      EXPECT_TRUE(listed.savedAsHalf && listed.isScalar);
      EXPECT_EQ(listed.skipReason, "");
      const VolumeGrid grid = readGrid(at("in.vdb"), "density");
      EXPECT_EQ(test::volumeDifference(grid.volume, expected.volume), "");
      EXPECT_EQ(grid.descriptor.valueType, ValueType::kHalf);
      EXPECT_EQ(grid.descriptor.background, 0.5);
      EXPECT_TRUE(grid.inactive == expected.inactive);
      const PackedGrid packed = readPacked(at("in.vdb"), "density");
      EXPECT_EQ(valueTypeOf(packed), "float");
      EXPECT_EQ(activeVoxelCount(packed), floats->activeVoxelCount());
    }
}

TEST_F(HalfGrids, CutAnywhereAreRefused) {
  saveHalfGrid(at("in.vdb"), openvdb::io::COMPRESS_ACTIVE_MASK);
  const auto whole = test::bytesIn(at("in.vdb"));
  for (std::size_t size = whole.size() - 1; size > 100; size -= std::min<std::size_t>(size, 97)) {
    test::writeBytes(at("in.vdb"), {whole.begin(), whole.begin() + std::ptrdiff_t(size)});
    EXPECT_FALSE(test::readable(at("in.vdb"), {})) << size;
  }
}

TEST_F(HalfGrids, AreCarriedBitForBit) {
  saveHalfGrid(at("in.vdb"), openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_BLOSC);
  const auto carried = readCarried(at("in.vdb"), std::vector<std::size_t>{0});
  EXPECT_EQ(carried.front().treeType, "Tree_half_5_4_3");
  EXPECT_EQ(inspectCarried(carried.front()).valueType, "float");
  EXPECT_EQ(test::volumeDifference(readGrid(carried.front()).volume,
                                   readGrid(at("in.vdb"), "density").volume),
            "");
}

// ---- Real files

using test::dataDir;

std::vector<std::string> uniqueNames(const VdbSummary& summary) {
  std::vector<std::string> names;
  for (const auto& grid : summary.grids) names.push_back(grid.uniqueName);
  return names;
}

struct RealFile {
  const char* path;
  std::uint64_t activeVoxels;
  std::size_t bricks;
  ValueType valueType;
  GridClass gridClass;
  const char* mapType;
};
std::ostream& operator<<(std::ostream& out, const RealFile& file) { return out << file.path; }

class RealFiles : public testing::TestWithParam<RealFile> {};

TEST_P(RealFiles, ReadAsTheirStatisticsSay) {
  ESVR_NEEDS_DATA();
  const auto path = dataDir() / GetParam().path;
  const auto summary = inspectVdb(path);
  ASSERT_EQ(summary.grids.size(), 1u);
  const auto& listed = summary.grids.front();
  EXPECT_EQ(summary.format, "OpenVDB");
  EXPECT_EQ(listed.skipReason, "");
  EXPECT_EQ(listed.activeVoxels, GetParam().activeVoxels);

  const auto grid = readGrid(path, listed.uniqueName);
  checkInvariants(grid.volume);
  EXPECT_EQ(activeVoxelCount(grid.volume), GetParam().activeVoxels);
  EXPECT_EQ(activeBox(grid.volume), listed.activeBox);
  EXPECT_EQ(grid.volume.brickCount(), GetParam().bricks);
  EXPECT_EQ(grid.descriptor.valueType, GetParam().valueType);
  EXPECT_EQ(grid.descriptor.gridClass, GetParam().gridClass);
  EXPECT_EQ(grid.descriptor.transform.mapType, GetParam().mapType);
  EXPECT_TRUE(grid.descriptor.transform.affine.has_value());
}

TEST_P(RealFiles, ComeBackAsTheyWere) {
  ESVR_NEEDS_DATA();
  const auto path = dataDir() / GetParam().path;
  const auto summary = inspectVdb(path);
  const auto grid = readGrid(path, summary.grids.front().uniqueName);
  const test::TemporaryFolder directory;
  writeGrids(directory / "back.vdb", summary.metadata, {&grid, 1});

  test::expectSame(readGrid(directory / "back.vdb", grid.descriptor.name), grid);
  const auto back = inspectVdb(directory / "back.vdb");
  EXPECT_THAT(back.metadata, testing::IsSupersetOf(summary.metadata));
  EXPECT_EQ(back.grids.front().activeVoxels, GetParam().activeVoxels);
  EXPECT_EQ(back.grids.front().activeBox, summary.grids.front().activeBox);
}

constexpr auto kFog = GridClass::kFogVolume;
INSTANTIATE_TEST_SUITE_P(
    Data, RealFiles,
    testing::Values(
        RealFile{"aneurism.vdb", 106773, 2891, ValueType::kFloat, kFog, "UniformScaleMap"},
        RealFile{"smoke1.vdb", 1049275, 3117, ValueType::kHalf, kFog, "UniformScaleTranslateMap"},
        RealFile{"wdas_cloud_sixteenth.vdb", 415642, 1371, ValueType::kFloat, kFog,
                 "UniformScaleMap"},
        RealFile{"dragon_with_xform.vdb", 156161, 679, ValueType::kFloat, kFog, "AffineMap"},
        RealFile{"cube_levelset.vdb", 1452218, 6812, ValueType::kHalf, GridClass::kLevelSet,
                 "UniformScaleMap"},
        RealFile{"hydrogen_atom.vdb", 686145, 1858, ValueType::kHalf, kFog, "UniformScaleMap"},
        RealFile{"neuron_m207.vdb", 549257, 7310, ValueType::kHalf, kFog, "UniformScaleMap"},
        RealFile{"neuron_rp140212.vdb", 398440, 6433, ValueType::kHalf, kFog, "UniformScaleMap"},
        RealFile{"edge/background_one.vdb", 9261, 64, ValueType::kFloat, kFog, "UniformScaleMap"},
        RealFile{"edge/double_grid.vdb", 524288, 1024, ValueType::kDouble, kFog,
                 "UniformScaleTranslateMap"}));

TEST(EdgeFiles, ThreeGridsOfOneNameAreToldApartByNumber) {
  ESVR_NEEDS_DATA();
  const auto path = dataDir() / "edge/three_grids_named_density.vdb";
  EXPECT_THAT(uniqueNames(inspectVdb(path)), ElementsAre("density[0]", "density[1]", "density[2]"));
  EXPECT_EQ(activeVoxelCount(readGrid(path, "density[0]").volume), 491u);
  EXPECT_EQ(activeVoxelCount(readGrid(path, "density[1]").volume), 2222u);
  EXPECT_EQ(activeVoxelCount(readGrid(path, "density[2]").volume), 803u);
}

TEST(EdgeFiles, AFrameOfASequenceListsEveryGridInFileOrder) {
  ESVR_NEEDS_DATA();
  const auto summary = inspectVdb(dataDir() / "sequence/gas_0006.vdb");
  ASSERT_EQ(summary.grids.size(), 24u);
  EXPECT_EQ(summary.grids[0].name, "velocity");
  EXPECT_EQ(summary.grids[7].name, "density");
  EXPECT_EQ(summary.grids[7].activeVoxels, 19289u);
  EXPECT_THAT(summary.grids[10].skipReason, HasSubstr("no active voxel"));
}

}  // namespace

}  // namespace esvr
