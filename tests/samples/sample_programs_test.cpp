// Plan: the programs are run as separate processes. The files of esvr-sample are read back, wrong options are refused with
// exit code and message, no incomplete file is left, and the voxels do not depend on the number of threads. By swc2vdb, a
// skeleton becomes tubes at its own position, wrong input is refused, and real skeletons are converted if they exist.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "esvr/vdb_io.h"
#include "support/machine.h"

namespace esvr {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// esvr-sample.

using test::Refusal;
using test::runProgram;
using test::TemporaryFolder;

test::ProgramRun sample(const std::vector<std::string>& arguments) {
  return runProgram(ESVR_SAMPLE, arguments);
}

TEST(EsvrSample, writesAGridThatReadsBack) {
  const TemporaryFolder folder;
  const std::string path = folder / "tree.vdb";
  const auto run = sample({"tree", path, "--resolution", "40"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, IsEmpty()) << "stdout is for data";
  EXPECT_THAT(run.err, HasSubstr("active voxels"));
  const VolumeGrid grid = readGrid(path, "density");
  EXPECT_EQ(grid.descriptor.gridClass, GridClass::kFogVolume);
  EXPECT_GT(activeVoxelCount(grid.volume), 100u);
  EXPECT_THAT(folder.names(), ElementsAre("tree.vdb"));
}

TEST(EsvrSample, writesSeveralGridsWithTheirMetadata) {
  const TemporaryFolder folder;
  const std::string path = folder / "two.vdb";
  ASSERT_EQ(sample({"two-grids", path, "--resolution", "32", "-q"}).exitCode, 0);
  const VdbSummary summary = inspectVdb(path);
  ASSERT_EQ(summary.grids.size(), 2u);
  EXPECT_TRUE(summary.grids[0].savedAsHalf);
  EXPECT_EQ(summary.grids[1].name, "temperature");
  const VolumeGrid temperature = readGrid(path, "temperature");
  EXPECT_EQ(temperature.volume.background, 0.25f);
}

TEST(EsvrSample, isTheSameForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const std::string one = folder / "1.vdb", many = folder / "5.vdb";
  ASSERT_EQ(sample({"plume", one, "--resolution", "48", "--threads", "1"}).exitCode, 0);
  ASSERT_EQ(sample({"plume", many, "--resolution", "48", "--threads", "5"}).exitCode, 0);
  EXPECT_EQ(readGrid(one, "density").volume.values, readGrid(many, "density").volume.values);
}

/// The first frame is the plume that does not move, and each frame is the same whether it is
/// written alone or with others.
TEST(EsvrSample, writesFramesOfAPlume) {
  const TemporaryFolder folder;
  const std::string still = folder / "still.vdb";
  ASSERT_EQ(sample({"plume", still, "--resolution", "32"}).exitCode, 0);
  const std::vector<std::string> frames{"plume", folder / "p.##.vdb", "--resolution",
                                        "32",    "--frames",          "3"};
  ASSERT_EQ(sample(frames).exitCode, 0);
  EXPECT_THAT(folder.names(), ElementsAre("p.01.vdb", "p.02.vdb", "p.03.vdb", "still.vdb"));
  const auto valuesOf = [](const std::string& path) {
    return readGrid(path, "density").volume.values;
  };
  const auto third = valuesOf(folder / "p.03.vdb");
  EXPECT_EQ(valuesOf(folder / "p.01.vdb"), valuesOf(still));
  EXPECT_NE(third, valuesOf(still));
  auto only = frames;
  only.insert(only.end(), {"--frame", "3", "-f"});
  ASSERT_EQ(sample(only).exitCode, 0);
  EXPECT_EQ(valuesOf(folder / "p.03.vdb"), third);
}

TEST(EsvrSample, refusesFramesOfWhatDoesNotMove) {
  const TemporaryFolder folder;
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"tree", folder / "t.##.vdb", "--frames", "3"},
        {"plume", folder / "p.vdb", "--frames", "3"},
        {"plume", folder / "p.##.vdb", "--frame", "3"},
        {"plume", folder / "p.##.vdb", "--frames", "3", "--frame", "4"}})
    EXPECT_EQ(sample(arguments).exitCode, 2) << arguments.back();
  EXPECT_THAT(folder.names(), IsEmpty());
}

TEST(EsvrSample, isQuietWhenAsked) {
  const TemporaryFolder folder;
  const auto run = sample({"blobs", folder / "b.vdb", "--resolution", "8", "--quiet"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.err, IsEmpty());
}

TEST(EsvrSample, keepsAnExistingFileUnlessForced) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.vdb";
  test::writeText(path, "precious");
  const auto refused = sample({"blobs", path, "--resolution", "8"});
  EXPECT_EQ(refused.exitCode, 1);
  EXPECT_THAT(refused.err, HasSubstr("--force"));
  EXPECT_EQ(test::readText(path), "precious");
  EXPECT_EQ(sample({"blobs", path, "--resolution", "8", "-f"}).exitCode, 0);
  EXPECT_NO_THROW((void)readGrid(path, "density"));
}

class RefusedSample : public testing::TestWithParam<Refusal> {};

TEST_P(RefusedSample, leavesNoFile) {
  const TemporaryFolder folder;
  const auto run = sample(GetParam().argumentsIn(folder));
  GetParam().expectOf(run);
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(folder.names(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedSample,
    testing::Values(Refusal{{}, 2, "missing argument KIND"},
                    Refusal{{"tree"}, 2, "missing argument OUT.vdb"},
                    Refusal{{"oak", "DIR/a.vdb"}, 2, "'oak'"},
                    Refusal{{"tree", "DIR/a.txt"}, 2, ".vdb or .nvdb"},
                    Refusal{{"tree", "DIR/a.vdb", "--resolution", "0"}, 2, "--resolution"},
                    Refusal{{"tree", "DIR/a.vdb", "--resolution", "-5"}, 2, "--resolution"},
                    Refusal{{"tree", "DIR/a.vdb", "--resolution", "many"}, 2, "many"},
                    Refusal{{"tree", "DIR/a.vdb", "--seed", "-1"}, 2, "--seed"},
                    Refusal{{"tree", "DIR/none/a.vdb"}, 1, "No such file"}));

TEST(EsvrSample, helpListsTheKindsAndVersionThePartsOnStdout) {
  const auto help = sample({"--help"});
  EXPECT_EQ(help.exitCode, 0);
  EXPECT_THAT(help.out, HasSubstr("two-grids"));
  EXPECT_THAT(help.err, IsEmpty());
  EXPECT_THAT(sample({"--version"}).out, HasSubstr("OpenVDB"));
}

TEST(EsvrSample, leavesNothingWhenInterrupted) {
  const TemporaryFolder folder;
  // Minutes of work.
  const auto run =
      test::runInterrupted(ESVR_SAMPLE, {"plume", folder / "a.vdb", "--resolution", "6000"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("interrupted; nothing was written"));
  EXPECT_THAT(folder.names(), IsEmpty());
}

TEST(EsvrSample, saysHowManyFramesAnInterruptionLeaves) {
  const TemporaryFolder folder;
  const auto run = test::runInterrupted(
      ESVR_SAMPLE, {"plume", folder / "a.@.vdb", "--resolution", "16", "--frames", "99999"},
      "a.2.vdb");
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr(" of 99999 frames "));
}

TEST(EsvrSample, saysSoWhenTheDiskIsFull) {
  const auto run = runProgram("/bin/sh", {"-c", std::string(ESVR_SAMPLE) + " --help > /dev/full"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("standard output"));
}

// swc2vdb.

using test::runProgram;
using test::TemporaryFolder;

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
  ESVR_NEEDS_DATA();
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
