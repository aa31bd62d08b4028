// Plan: esvr2vdb writes grids at other resolutions. The voxels and the transform that other programs read are those of the
// library (tests/encode/resolution_test.cpp), for .vdb and .nvdb files, vectors and parts of files; auto keeps to the
// memory and says what it chose; options that contradict each other are refused.

#include <algorithm>

#include "cli/conversion.h"
#include "esvr/resolution.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

class CoarserGrid : public Vdb2Esvr {
 protected:
  void SetUp() override {
    writeInput(in(), {{.voxels = cloud(20)}});
    succeeded(vdb2esvr({in(), out(), "--lossless"}));
  }
  [[nodiscard]] ProgramRun write(const Words& options) const {
    return esvr2vdb(joined({out(), back(), "--force"}, options));
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
    succeeded(write({"--coarsen", factor}));
    expectSame(readGrid(back(), 0), decodeAtResolution(stored, std::stod(factor)));
  }
  const std::string nano = folder_ / "back.nvdb";
  succeeded(esvr2vdb({out(), nano, "--coarsen", "2"}));
  EXPECT_EQ(readGrid(nano, 0).volume.active, decodeAtResolution(stored, 2.0).volume.active);
}

TEST_F(CoarserGrid, hasTheSizeOfVoxelsThatIsAskedFor) {
  const StoredGrid stored = readEsvr(out()).grids.front();
  const double size = (*stored.descriptor.transform.affine)[0];
  succeeded(write({"--voxel-size", std::to_string(3.0 * size)}));
  expectSame(readGrid(back(), 0), decodeAtResolution(stored, 3.0));
  EXPECT_THAT(write({"--voxel-size", std::to_string(0.5 * size)}), Fails(2, "cannot become finer"));
  succeeded(quickFit(in(), out(), "--force"));
  succeeded(write({"--voxel-size", std::to_string(0.5 * size)}));
  EXPECT_GT(activeVoxelCount(readGrid(back(), 0).volume), 4 * stored.activeVoxels);
}

TEST_F(CoarserGrid, isAsLargeAsTheMemoryAllows) {
  succeeded(write("--coarsen auto"));
  EXPECT_EQ(activeVoxelCount(readGrid(back(), 0).volume),
            readEsvr(out()).grids.front().activeVoxels);
  std::filesystem::remove(in());
  writeGrids(in(), {}, std::vector<VolumeGrid>{filledCube()});
  succeeded(vdb2esvr({in(), out(), "--force", "--max-error", "0.005"}));
  EXPECT_THAT(succeeded(write("--coarsen auto --max-memory 10MB")).err,
              HasSubstr("--coarsen auto: voxels become"));
  EXPECT_LT(8 * activeVoxelCount(readGrid(back(), 0).volume),
            2 * readEsvr(out()).grids.front().activeVoxels);
}

TEST_F(CoarserGrid, leavesCarriedGridsWhereTheMemoryAllowsAllVoxels) {
  std::filesystem::remove(in());
  writeInput(in(), {{.voxels = softBall({})}, {.name = "kept", .voxels = softBall({})}});
  succeeded(quickFit(in(), out(), "--force --keep kept"));
  EXPECT_EQ(succeeded(write("--coarsen auto")).err, "");
  EXPECT_THAT(inspectVdb(back()).grids, testing::SizeIs(2));
  EXPECT_THAT(succeeded(write("--coarsen 2")).err, HasSubstr("is left out"));
  EXPECT_THAT(inspectVdb(back()).grids, testing::SizeIs(1));
}

TEST_F(CoarserGrid, ofVectorsIsThatOfTheirComponents) {
  writeVectorInput(in(), {.voxels = softBall({})});
  succeeded(
      vdb2esvr({in(), out(), "--force", "--representation", "voxels", "--max-error", "0.001"}));
  succeeded(write("--coarsen 2"));
  const EsvrFile file = readEsvr(out());
  const VectorGrid expected =
      decodeVectorAtResolution("velocity", componentsOf(file, file.vectors.front()), 2.0);
  const VectorVolume made = readVector(back(), 0).components, wanted = aligned(expected.components);
  for (std::size_t c = 0; c < kComponents; ++c)
    EXPECT_TRUE(std::ranges::equal(made[c].values, wanted[c].values));
}

TEST_F(CoarserGrid, isRefusedWhereOptionsContradictEachOther) {
  for (const auto& [options, words] :
       {std::pair{Words{"--coarsen", "3"}, "--coarsen must be 2, 4, 8 or auto"},
        {{"--coarsen", "2", "--voxel-size", "1"}, "exclude each other"},
        {{"--coarsen", "2", "--reference", in()}, "--reference compares voxels of one size"},
        {{"--voxel-size", "1e9"}, "grid 'density': voxels can become"}}) {
    EXPECT_THAT(write(options), Fails(2, words));
  }
  EXPECT_THAT(esvr2vdb({"--list", out(), "--coarsen", "2"}), Fails(2));
}

TEST_F(CoarserGrid, isRefusedByItsNameWhereItIsAFrustum) {
  std::filesystem::remove(in());
  writeInput(in(), {{.voxels = softBall({})},
                    {.name = "seen", .voxels = softBall({}), .map = InputMap::kFrustum}});
  succeeded(quickFit(in(), out(), "--force"));
  for (const Words& options : {Words{"--coarsen", "2"}, {"--voxel-size", "1"}})
    EXPECT_THAT(write(options), Fails(2, "grid 'seen': the voxels of a frustum"));
  succeeded(write({"--coarsen", "2", "-g", "density"}));
}

}  // namespace
}  // namespace esvr::test
