// Plan: esvr2vdb writes grids at other resolutions. The voxels and the transform that other programs read are those of the
// library (tests/encode/resolution_test.cpp), for .vdb and .nvdb files, vectors and parts of files; auto keeps to the
// memory and says what it chose; options that contradict each other are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "esvr/resolution.h"

namespace esvr {
namespace {

using test::softBall;
using testing::AllOf;
using testing::HasSubstr;

class CoarserGrid : public test::Vdb2Esvr {
 protected:
  void SetUp() override {
    test::writeInput(in(), {{.voxels = test::cloud(20)}});
    ASSERT_EQ(test::vdb2esvr({in(), out(), "--lossless"}).exitCode, 0);
  }
  [[nodiscard]] std::string back() const { return folder_ / "back.vdb"; }
  [[nodiscard]] test::ProgramRun write(std::vector<std::string> options) const {
    options.insert(options.begin(), {out(), back(), "--force"});
    return test::esvr2vdb(options);
  }
};

/// A cube of 96^3 active voxels. Its voxels take 3.6 MB, and those of a decoded file as much again.
VolumeGrid filledCube() {
  VolumeGrid grid;
  grid.descriptor.name = "density";
  grid.descriptor.transform = uniformTransform(1.0);
  std::vector<BrickInput> bricks;
  constexpr int kSide = 12;
  for (int b = 0; b < kSide * kSide * kSide; ++b) {
    BrickInput& brick = bricks.emplace_back();
    brick.corner = Coord{b / (kSide * kSide), b / kSide % kSide, b % kSide} * kBrickSide;
    for (std::size_t v = 0; v < kBrickVoxels; ++v)
      brick.values[v] = float((v * 7 + std::size_t(b)) % 64 + 1) / 64.0f;
    brick.active.setAll();
  }
  grid.volume = makeVolume(std::move(bricks), 0.0f);
  return grid;
}

void expectSame(const VolumeGrid& a, const VolumeGrid& b) {
  EXPECT_EQ(a.descriptor.transform.affine, b.descriptor.transform.affine);
  EXPECT_EQ(a.volume.bricks, b.volume.bricks);
  EXPECT_EQ(a.volume.origin, b.volume.origin);
  EXPECT_EQ(a.volume.active, b.volume.active);
  EXPECT_TRUE(std::ranges::equal(a.volume.values, b.volume.values));
}

TEST_F(CoarserGrid, hasTheAveragesAndTheTransform) {
  const StoredGrid stored = readEsvr(out()).grids.front();
  for (const char* factor : {"2", "4", "8"}) {
    ASSERT_EQ(write({"--coarsen", factor}).exitCode, 0);
    expectSame(readGrid(back(), 0), decodeAtResolution(stored, std::stod(factor)));
  }
  const std::string nano = folder_ / "back.nvdb";
  ASSERT_EQ(test::esvr2vdb({out(), nano, "--coarsen", "2"}).exitCode, 0);
  EXPECT_EQ(readGrid(nano, 0).volume.active, decodeAtResolution(stored, 2.0).volume.active);
}

TEST_F(CoarserGrid, hasTheSizeOfVoxelsThatIsAskedFor) {
  const StoredGrid stored = readEsvr(out()).grids.front();
  const double size = (*stored.descriptor.transform.affine)[0];
  ASSERT_EQ(write({"--voxel-size", std::to_string(3.0 * size)}).exitCode, 0);
  expectSame(readGrid(back(), 0), decodeAtResolution(stored, 3.0));
  const auto finer = write({"--voxel-size", std::to_string(0.5 * size)});
  EXPECT_EQ(finer.exitCode, 2);
  EXPECT_THAT(finer.err, HasSubstr("cannot become finer"));
  ASSERT_EQ(test::quickFit(in(), out(), {"--force"}).exitCode, 0);
  ASSERT_EQ(write({"--voxel-size", std::to_string(0.5 * size)}).exitCode, 0);
  EXPECT_GT(activeVoxelCount(readGrid(back(), 0).volume), 4 * stored.activeVoxels);
}

TEST_F(CoarserGrid, isAsLargeAsTheMemoryAllows) {
  const auto whole = write({"--coarsen", "auto"});
  ASSERT_EQ(whole.exitCode, 0) << whole.err;
  EXPECT_EQ(activeVoxelCount(readGrid(back(), 0).volume),
            readEsvr(out()).grids.front().activeVoxels);
  std::filesystem::remove(in());
  writeGrids(in(), {}, std::vector<VolumeGrid>{filledCube()});
  ASSERT_EQ(test::vdb2esvr({in(), out(), "--force", "--max-error", "0.005"}).exitCode, 0);
  const auto small = write({"--coarsen", "auto", "--max-memory", "10MB"});
  ASSERT_EQ(small.exitCode, 0) << small.err;
  EXPECT_THAT(small.err, HasSubstr("--coarsen auto: voxels become"));
  EXPECT_LT(8 * activeVoxelCount(readGrid(back(), 0).volume),
            2 * readEsvr(out()).grids.front().activeVoxels);
}

TEST_F(CoarserGrid, ofVectorsIsThatOfTheirComponents) {
  test::writeVectorInput(in(), {.voxels = softBall({})});
  ASSERT_EQ(
      test::vdb2esvr({in(), out(), "--force", "--representation", "voxels", "--max-error", "0.001"})
          .exitCode,
      0);
  ASSERT_EQ(write({"--coarsen", "2"}).exitCode, 0);
  const EsvrFile file = readEsvr(out());
  const VectorGrid expected =
      decodeVectorAtResolution("velocity", componentsOf(file, file.vectors.front()), 2.0);
  const VectorVolume made = readVector(back(), 0).components, wanted = aligned(expected.components);
  for (std::size_t c = 0; c < kComponents; ++c)
    EXPECT_TRUE(std::ranges::equal(made[c].values, wanted[c].values));
}

TEST_F(CoarserGrid, isRefusedWhereOptionsContradictEachOther) {
  for (const auto& [options, words] :
       {std::pair{std::vector<std::string>{"--coarsen", "3"}, "--coarsen must be 2, 4, 8 or auto"},
        {{"--coarsen", "2", "--voxel-size", "1"}, "exclude each other"},
        {{"--coarsen", "2", "--reference", in()}, "--reference compares voxels of one size"},
        {{"--voxel-size", "1e9"}, "as large"}}) {
    const auto run = write(options);
    EXPECT_EQ(run.exitCode, 2);
    EXPECT_THAT(run.err, HasSubstr(words));
  }
  EXPECT_EQ(test::esvr2vdb({"--list", out(), "--coarsen", "2"}).exitCode, 2);
}

}  // namespace
}  // namespace esvr
