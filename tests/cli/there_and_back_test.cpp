// Plan: each kind of extreme grid is fitted, written and decoded by the programs. Name, class,
// transform, metadata, background and `creator` come back exactly. The PSNR of the voxels is high
// enough to show that the values are in the right places; it is low because the fits are short.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using test::InputGrid;
using test::InputMap;
using test::softBall;
using testing::ElementsAre;
using testing::IsSupersetOf;

struct Journey {
  const char* name;
  InputGrid grid;
  double lowestPsnr;  ///< dB over the active voxels
};
std::ostream& operator<<(std::ostream& out, const Journey& journey) { return out << journey.name; }

void expectSameFrame(const GridDescriptor& back, const GridDescriptor& source) {
  EXPECT_EQ(back.name, source.name);
  EXPECT_EQ(back.gridClass, source.gridClass);
  EXPECT_EQ(back.transform, source.transform);
  EXPECT_EQ(back.background, source.background);
  EXPECT_THAT(back.metadata, IsSupersetOf(source.metadata));
}

class ThereAndBack : public testing::TestWithParam<Journey> {
 protected:
  void SetUp() override { test::writeInput(source(), {GetParam().grid}); }
  [[nodiscard]] std::string source() const { return folder_ / "in.vdb"; }
  [[nodiscard]] std::string fitted() const { return folder_ / "in.esvr"; }
  [[nodiscard]] std::string back() const { return folder_ / "back.vdb"; }

  test::TemporaryFolder folder_;
};

TEST_P(ThereAndBack, keepsAllThatIsNotVoxelsAndTheVoxelsAsFitted) {
  const auto fit = test::quickFit(source(), fitted());
  ASSERT_EQ(fit.exitCode, 0) << fit.err;
  const auto decode = test::esvr2vdb({fitted(), back()});
  ASSERT_EQ(decode.exitCode, 0) << decode.err;
  EXPECT_THAT(folder_.names(), ElementsAre("back.vdb", "in.esvr", "in.vdb"));

  const VolumeGrid before = readGrid(source(), "density"), after = readGrid(back(), "density");
  expectSameFrame(after.descriptor, before.descriptor);
  EXPECT_THAT(inspectVdb(back()).metadata,
              testing::Contains(stringItem("creator", test::kInputCreator)));
  EXPECT_GE(compareVolumes(before.volume, after.volume).psnrActive, GetParam().lowestPsnr);
}

InputGrid ball(Coord center, float peak = 1.0f, float background = 0.0f) {
  return {.voxels = softBall(center, peak, background), .background = background};
}

InputGrid ballUnder(InputMap map) {
  InputGrid grid = ball({});
  grid.map = map;
  return grid;
}

InputGrid constantBlock() {
  InputGrid grid;
  for (const auto& voxel : softBall({8, 8, 8})) grid.voxels.push_back({voxel.at, 0.7f});
  return grid;
}

InputGrid bothSigns() {
  InputGrid grid = ball({});
  for (const auto& voxel : softBall({20, 0, 0}, -2.0f)) grid.voxels.push_back(voxel);
  return grid;
}

constexpr double kAlike = 25.0;  // dB; errors are about a twentieth of the peak
constexpr double kExact = 100.0;
constexpr int kFar = 10'000'000;

INSTANTIATE_TEST_SUITE_P(
    Extremes, ThereAndBack,
    testing::Values(Journey{"an ordinary ball", ball({}), kAlike},
                    Journey{"one voxel", {.voxels = {{{3, -4, 5}, 0.5f}}}, kAlike},
                    Journey{"one constant", constantBlock(), 15.0},
                    Journey{"all zeros", ball({}, 0.0f), kExact},
                    Journey{"one value, the background's", ball({}, 0.0f, 1.0f), kExact},
                    Journey{"background not zero", ball({}, 2.0f, 1.0f), kAlike},
                    Journey{"negative values", ball({}, -3.0f), kAlike},
                    Journey{"both signs", bothSigns(), kAlike},
                    Journey{"tiny values", ball({}, 1e-30f), kAlike},
                    Journey{"huge values", ball({}, 1e30f), kAlike},
                    Journey{"the largest values that are fitted", ball({}, 1e36f), kAlike},
                    Journey{"far up", ball({kFar, kFar, kFar}), kAlike},
                    Journey{"far down", ball({-kFar, -kFar, -kFar}), kAlike},
                    Journey{"a rotated map", ballUnder(InputMap::kRotated), kAlike},
                    Journey{"a sheared map", ballUnder(InputMap::kSheared), kAlike},
                    Journey{"a frustum", ballUnder(InputMap::kFrustum), kAlike}));

TEST(LevelSet, withActiveVoxelsBeyondItsBandComesBackUnchanged) {
  const test::TemporaryFolder folder;
  const std::string source = folder / "in.vdb", fitted = folder / "in.esvr";
  test::writeInput(source, {{.voxels = test::distances(12), .background = 1.0f, .levelSet = true}});
  const auto fit = test::vdb2esvr({source, fitted, "--count", "300", "--iterations", "300"});
  ASSERT_EQ(fit.exitCode, 0) << fit.err;
  const auto back = test::esvr2vdb({fitted, folder / "back.vdb"});
  ASSERT_EQ(back.exitCode, 0) << back.err;
  const VolumeMetrics m = compareVolumes(readGrid(source, "density").volume,
                                         readGrid(folder / "back.vdb", "density").volume);
  EXPECT_GT(m.psnrActive, kAlike);
}

TEST(ShiftedVolume, givesTheSameVoxelsElsewhere) {
  const test::TemporaryFolder folder;
  const Coord shift{1 << 20, -(1 << 20), 1 << 20};
  test::writeInput(folder / "here.vdb", {ball({})});
  test::writeInput(folder / "there.vdb", {ball(shift)});
  for (const std::string name : {"here", "there"}) {
    ASSERT_EQ(test::quickFit(folder / (name + ".vdb"), folder / (name + ".esvr")).exitCode, 0);
    ASSERT_EQ(test::esvr2vdb({folder / (name + ".esvr"), folder / (name + "_back.vdb")}).exitCode,
              0);
  }
  const SparseVolume here = readGrid(folder / "here_back.vdb", "density").volume;
  const SparseVolume there = readGrid(folder / "there_back.vdb", "density").volume;
  EXPECT_EQ(there.origin, here.origin + shift);
  EXPECT_EQ(there.bricks, here.bricks);
  EXPECT_EQ(there.values, here.values);
  EXPECT_EQ(there.active, here.active);
}

}  // namespace
}  // namespace esvr
