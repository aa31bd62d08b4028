// Plan: grids of the type HalfGrid, which OpenVDB 13 has, are written by the OpenVDB that is there. They are read as
// the same grid of floats that is saved as half, with every packing, and refused where they are cut.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vdb/foreign_grids.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

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
  auto bytes = test::bytesOf(path);
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
      test::expectSameBits(grid.volume, expected.volume);
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
  const auto whole = test::bytesOf(at("in.vdb"));
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
  test::expectSameBits(readGrid(carried.front()).volume, readGrid(at("in.vdb"), "density").volume);
}

}  // namespace
}  // namespace esvr
