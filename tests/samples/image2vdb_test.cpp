// Plan: image2vdb is run as a separate process. The tests check RAW and NRRD images, their options,
// and the exit codes and messages of refused input.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using test::runProgram;
using test::TemporaryFolder;
using testing::HasSubstr;

/// 4 x 3 x 2 bytes with the values 0, 10, 20, ...
std::string ramp() {
  std::string bytes;
  for (int i = 0; i < 24; ++i) bytes.push_back(char(i * 10));
  return bytes;
}

TEST(Image2Vdb, bringsInRawWithThresholdAndNormalised) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.raw", ramp());
  const std::string out = folder / "a.vdb";
  const auto run = runProgram(
      IMAGE2VDB, {folder / "a.raw", out, "--dims", "4,3,2", "--type", "uint8", "--threshold", "100",
                  "--normalise", "--voxel-size", "0.5", "--name", "ct"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const VolumeGrid grid = readGrid(out, "ct");
  EXPECT_EQ(activeVoxelCount(grid.volume), 14u);
  EXPECT_EQ(valueAt(grid.volume, {2, 2, 0}), 100.0f / 255.0f);
  EXPECT_EQ(valueAt(grid.volume, {3, 2, 1}), 230.0f / 255.0f);
  EXPECT_EQ(valueAt(grid.volume, {1, 2, 0}), 0.0f);
  EXPECT_EQ(grid.descriptor.transform.affine.value()[0], 0.5);
}

TEST(Image2Vdb, bringsInNrrdWithItsTransform) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.raw", ramp());
  test::writeText(
      folder / "a.nhdr",
      "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\nspacings: 1 2 3\n"
      "data file: a.raw\n");
  const std::string out = folder / "a.vdb";
  const auto run = runProgram(IMAGE2VDB, {folder / "a.nhdr", out});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const VolumeGrid grid = readGrid(out, "density");
  EXPECT_EQ(activeVoxelCount(grid.volume), 23u) << "all but the voxel that is 0";
  EXPECT_EQ(grid.descriptor.transform.affine.value()[10], 3.0);
}

struct RawRefusal {
  const char* file;
  std::string content;
  std::vector<std::string> options;
  int code;
  const char* message;
};

class RefusedImage : public testing::TestWithParam<RawRefusal> {};

TEST_P(RefusedImage, leavesNoOutput) {
  const TemporaryFolder folder;
  test::writeText(folder / GetParam().file, GetParam().content);
  std::vector<std::string> arguments{folder / GetParam().file, folder / "out.vdb"};
  const auto& options = GetParam().options;
  arguments.insert(arguments.end(), options.begin(), options.end());
  const auto run = runProgram(IMAGE2VDB, arguments);
  EXPECT_EQ(run.exitCode, GetParam().code) << run.err;
  EXPECT_THAT(run.err, HasSubstr(GetParam().message));
  EXPECT_THAT(folder.names(), testing::ElementsAre(GetParam().file));
}

const std::vector<std::string> kRamp{"--dims", "4,3,2", "--type", "uint8"};

std::vector<std::string> rampAnd(std::vector<std::string> more) {
  more.insert(more.begin(), kRamp.begin(), kRamp.end());
  return more;
}

const std::string kNan("\0\0\xc0\x7f", 4);
const std::string kFlatNrrd =
    "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: raw\nspace dimension: 3\n"
    "space directions: (1,0,0) (1,0,0) (0,0,1)\n\n1";

INSTANTIATE_TEST_SUITE_P(
    All, RefusedImage,
    testing::Values(
        RawRefusal{"a.raw", ramp(), {}, 2, "--dims"},
        RawRefusal{"a.raw", ramp(), {"--dims", "4,3", "--type", "uint8"}, 2, "4,3"},
        RawRefusal{"a.raw", ramp(), {"--dims", "4,3,-2", "--type", "uint8"}, 2, "4,3,-2"},
        RawRefusal{"a.raw", ramp(), {"--dims", "4,3,2,", "--type", "uint8"}, 2, "4,3,2,"},
        RawRefusal{"a.raw", ramp(), {"--dims", "4,3,2", "--type", "byte"}, 2, "uint8, int8"},
        RawRefusal{"a.raw", ramp().substr(1), kRamp, 3, "23 bytes"},
        RawRefusal{"a.raw", ramp(), rampAnd({"--skip", "1"}), 3, "need 25"},
        RawRefusal{"a.raw", ramp(), rampAnd({"--skip", "-1"}), 2, "--skip"},
        RawRefusal{"a.raw", ramp(), rampAnd({"--endian", "middle"}), 2, "little or big"},
        RawRefusal{"a.raw", ramp(), rampAnd({"--nonfinite", "keep"}), 2, "refuse or zero"},
        RawRefusal{"a.raw", ramp(), rampAnd({"--threshold", "999"}), 3, "no active voxel"},
        RawRefusal{"a.raw", ramp(), rampAnd({"--voxel-size", "0"}), 2, "--voxel-size"},
        RawRefusal{"a.raw", kNan, {"--dims", "1,1,1", "--type", "float32"}, 3, "(0, 0, 0)"},
        RawRefusal{"a.nrrd", "NRRD0004\n", {}, 3, "a.nrrd"},
        RawRefusal{"a.nrrd", kFlatNrrd, {}, 3, "linearly dependent"},
        RawRefusal{"a.nrrd", kFlatNrrd, {"--dims", "1,1,1"}, 2, "--dims is for RAW"}));

TEST(Image2Vdb, refusesAnImageThatIsNotThere) {
  const TemporaryFolder folder;
  const auto run = runProgram(
      IMAGE2VDB, {folder / "none.raw", folder / "out.vdb", "--dims", "1,1,1", "--type", "uint8"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("No such file"));
}

TEST(Image2Vdb, replacesWhatIsNotFiniteWhenAskedAndSaysHowMuch) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.raw", kNan + std::string("\0\0\x80\x3f", 4));
  const std::string out = folder / "a.vdb";
  const auto run = runProgram(IMAGE2VDB, {folder / "a.raw", out, "--dims", "2,1,1", "--type",
                                          "float32", "--nonfinite", "zero"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("warning: 1 voxels"));
  EXPECT_EQ(activeVoxelCount(readGrid(out, "density").volume), 1u);
}

}  // namespace
}  // namespace esvr
