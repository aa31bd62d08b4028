// Plan: swc2vdb is run as a separate process. A skeleton becomes tubes at its own position, wrong
// input is refused, and real skeletons are converted if they exist.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using test::runProgram;
using test::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kBar = "1 0 100 200 300 4 -1\n2 0 160 200 300 4 1\n";

TEST(Swc2Vdb, putsTubesWhereTheSkeletonLies) {
  const TemporaryFolder folder;
  test::writeText(folder / "bar.swc", kBar);
  const std::string out = folder / "bar.vdb";
  const auto run = runProgram(SWC2VDB, {folder / "bar.swc", out, "--resolution", "34"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const VolumeGrid grid = readGrid(out, "density");
  const auto& m = grid.descriptor.transform.affine.value();
  EXPECT_DOUBLE_EQ(m[0], 2.0) << "68 units on 34 voxels";
  // The voxel in the middle of the bar is inside.
  const auto index = [&](double world, std::size_t axis) {
    return int((world - m[12 + axis]) / m[0] + 0.5);
  };
  EXPECT_EQ(valueAt(grid.volume, {index(130, 0), index(200, 1), index(300, 2)}), 1.0f);
  EXPECT_EQ(valueAt(grid.volume, {index(130, 0), index(212, 1), index(300, 2)}), 0.0f);
}

TEST(Swc2Vdb, thickensThinTubesAsAsked) {
  const TemporaryFolder folder;
  test::writeText(folder / "thin.swc", "1 0 0 0 0 0.001 -1\n2 0 60 0 0 0.001 1\n");
  const auto voxels = [&](const std::string& radius) {
    const std::string out = folder / (radius + ".vdb");
    EXPECT_EQ(runProgram(SWC2VDB,
                         {folder / "thin.swc", out, "--resolution", "60", "--min-radius", radius})
                  .exitCode,
              0);
    return activeVoxelCount(readGrid(out, "density").volume);
  };
  EXPECT_GT(voxels("4"), 6 * voxels("0.75"));
}

TEST(Swc2Vdb, keepsTheLongestPieceOnly) {
  const TemporaryFolder folder;
  test::writeText(folder / "two.swc", std::string(kBar) + "8 0 0 0 0 1 -1\n9 0 5 0 0 1 8\n");
  const std::string out = folder / "one.vdb";
  ASSERT_EQ(runProgram(SWC2VDB, {folder / "two.swc", out, "--resolution", "34", "--longest", "1"})
                .exitCode,
            0);
  EXPECT_DOUBLE_EQ(readGrid(out, "density").descriptor.transform.affine.value()[0], 2.0);
}

struct SwcRefusal {
  const char* text;
  std::vector<std::string> options;
  int code;
  const char* message;
};

class RefusedSwcFile : public testing::TestWithParam<SwcRefusal> {};

TEST_P(RefusedSwcFile, leavesNoOutput) {
  const TemporaryFolder folder;
  test::writeText(folder / "in.swc", GetParam().text);
  std::vector<std::string> arguments{folder / "in.swc", folder / "out.vdb"};
  const auto& options = GetParam().options;
  arguments.insert(arguments.end(), options.begin(), options.end());
  const auto run = runProgram(SWC2VDB, arguments);
  EXPECT_EQ(run.exitCode, GetParam().code);
  EXPECT_THAT(run.err, HasSubstr(GetParam().message));
  EXPECT_THAT(folder.names(), testing::ElementsAre("in.swc"));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedSwcFile,
    testing::Values(SwcRefusal{"", {}, 3, "no node"},
                    SwcRefusal{"1 0 0 0\n", {}, 3, "in.swc, line 1"},
                    SwcRefusal{"1 0 5 5 5 0 -1\n", {}, 3, "no extent"},
                    SwcRefusal{"1 0 0 0 0 1e-7 -1\n2 0 1e-6 0 0 0 1\n", {}, 3, "too small"},
                    SwcRefusal{kBar, {"--resolution", "0"}, 2, "--resolution"},
                    SwcRefusal{kBar, {"--min-radius", "nan"}, 2, "--min-radius"},
                    SwcRefusal{kBar, {"--edge", "0"}, 2, "--edge"},
                    SwcRefusal{kBar, {"--longest", "0"}, 2, "--longest"}));

TEST(Swc2Vdb, refusesASkeletonThatIsNotThere) {
  const TemporaryFolder folder;
  const auto run = runProgram(SWC2VDB, {folder / "none.swc", folder / "out.vdb"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("No such file"));
}

TEST(Swc2Vdb, RealFilesOfSkeletonsBecomeThinTubes) {
  if (std::string(ESVR_DATA_DIR).empty()) GTEST_SKIP() << "ESVR_DATA_DIR is not set";
  for (const char* name : {"m207", "hemibrain_754538881"}) {
    const TemporaryFolder folder;
    const std::string in = std::string(ESVR_DATA_DIR) + "/swc/" + name + ".swc";
    const std::string out = folder / "neuron.vdb";
    const auto run = runProgram(SWC2VDB, {in, out, "--resolution", "256"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const SparseVolume volume = readGrid(out, "density").volume;
    const double share = double(activeVoxelCount(volume)) / activeBox(volume).volume();
    EXPECT_GT(share, 1e-4) << name;
    EXPECT_LT(share, 0.05) << name;
  }
}

}  // namespace
}  // namespace esvr
