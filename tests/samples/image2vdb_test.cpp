// Plan: image2vdb is run as a separate process. The tests check an image of each format, the options,
// and the exit codes and messages of refused input. The readers have tests of their own.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "cli/run_program.h"
#include "esvr/vdb_io.h"
#include "images/image_format.h"
#include "samples/whole_image.h"
#if ESVR_HAS_HDF5
#include "samples/hdf5_writer.h"
#endif

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

TEST(Image2Vdb, bringsInRawBehindAHeaderInEitherByteOrder) {
  const TemporaryFolder folder;
  for (const bool big : {false, true}) {
    test::writeText(folder / "a.raw",
                    "head" + samples::bytesOf(std::vector<std::int16_t>{300, -2}, big));
    const std::string out = folder / "a.vdb";
    const auto run =
        runProgram(IMAGE2VDB, {folder / "a.raw", out, "--dims", "2,1,1", "--type", "int16",
                               "--skip", "4", "--endian", big ? "big" : "little", "-f"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(valueAt(readGrid(out, "density").volume, {0, 0, 0}), 300.0f);
  }
}

/// A TIFF file with one page of 2 x 1 bytes, written byte by byte.
std::string tinyTiff(char left, char right) {
  using samples::bytesOf;
  const auto entry = [](int tag, int value) {
    return bytesOf(std::uint16_t(tag)) + bytesOf(std::uint16_t{4}) + bytesOf(std::uint32_t{1}) +
           bytesOf(std::uint32_t(value));
  };
  const std::string entries = entry(256, 2) + entry(257, 1) + entry(258, 8) + entry(259, 1) +
                              entry(262, 1) + entry(273, 8) + entry(277, 1) + entry(279, 2);
  return std::string("II*\0", 4) + bytesOf(std::uint32_t{10}) + left + right +
         bytesOf(std::uint16_t{8}) + entries + std::string(4, '\0');
}

/// Converts without options, or with those that are given.
VolumeGrid converted(const TemporaryFolder& folder, const std::string& input,
                     const std::vector<std::string>& options = {}) {
  const std::string out = folder / "out.vdb";
  std::vector<std::string> arguments{folder / input, out, "-f"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const auto run = runProgram(IMAGE2VDB, arguments);
  EXPECT_EQ(run.exitCode, 0) << run.err;
  return readGrid(out, "density");
}

#if ESVR_HAS_TIFF
TEST(Image2Vdb, bringsInTiffWithoutOptions) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.tif", tinyTiff(3, 4));
  EXPECT_EQ(valueAt(converted(folder, "a.tif").volume, {1, 0, 0}), 4.0f);
  test::writeText(folder / "a.dat", tinyTiff(3, 5));
  EXPECT_EQ(valueAt(converted(folder, "a.dat").volume, {1, 0, 0}), 5.0f) << "the content decides";
}

TEST(Image2Vdb, stacksSlicesOfAFolderAPatternOrSeveralFiles) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "s");
  for (const int i : {8, 9, 10})
    test::writeText(folder / ("s/a" + std::to_string(i) + ".tif"), tinyTiff(1, char(i)));
  const auto expectStack = [](const VolumeGrid& grid) {
    for (const int z : {0, 1, 2}) EXPECT_EQ(valueAt(grid.volume, {1, 0, z}), float(8 + z));
  };
  expectStack(converted(folder, "s"));
  expectStack(converted(folder, "s/a@.tif"));
  const auto run = runProgram(IMAGE2VDB, {folder / "s/a8.tif", folder / "s/a9.tif",
                                          folder / "s/a10.tif", folder / "out.vdb", "-f"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, testing::Not(HasSubstr("warning")));
  expectStack(readGrid(folder / "out.vdb", "density"));
}

TEST(Image2Vdb, warnsOfSlicesInAnotherOrderThanTheirNumbers) {
  const TemporaryFolder folder;
  for (const int i : {2, 10})
    test::writeText(folder / ("a" + std::to_string(i) + ".tif"), tinyTiff(1, char(i)));
  const auto run =
      runProgram(IMAGE2VDB, {folder / "a10.tif", folder / "a2.tif", folder / "out.vdb"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("warning: the slices are in the order given"));
  EXPECT_EQ(valueAt(readGrid(folder / "out.vdb", "density").volume, {1, 0, 0}), 10.0f);
}

TEST(Image2Vdb, takesTheEdgesOfVoxelsThatAreGiven) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.tif", tinyTiff(3, 4));
  const auto edges = [&](const char* text) {
    const auto m =
        converted(folder, "a.tif", {"--voxel-size", text}).descriptor.transform.affine.value();
    return std::array{m[0], m[5], m[10]};
  };
  EXPECT_THAT(edges("0.5"), testing::ElementsAre(0.5, 0.5, 0.5));
  EXPECT_THAT(edges("0.5,2,3"), testing::ElementsAre(0.5, 2.0, 3.0));
}

TEST(Image2Vdb, replacesAFileWhereForced) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.tif", tinyTiff(3, 4));
  test::writeText(folder / "out.vdb", "old");
  EXPECT_EQ(runProgram(IMAGE2VDB, {folder / "a.tif", folder / "out.vdb"}).exitCode, 1);
  EXPECT_EQ(runProgram(IMAGE2VDB, {folder / "a.tif", folder / "out.vdb", "--force"}).exitCode, 0);
}
#endif

#if ESVR_HAS_NIFTI
TEST(Image2Vdb, bringsInNiftiWithItsTransform) {
  const TemporaryFolder folder;
  std::string header(352, '\0');
  const auto set = [&](std::size_t place, const auto& value) {
    const std::string bytes = samples::bytesOf(value);
    header.replace(place, bytes.size(), bytes);
  };
  set(0, std::int32_t{348});
  set(40, std::vector<std::int16_t>{3, 2, 1, 1, 1, 1, 1, 1});
  set(70, std::vector<std::int16_t>{2, 8});  // bytes
  set(76, std::vector<float>{1, 1, 1, 1});
  set(108, 352.0f);
  set(254, std::int16_t{1});
  set(280, std::vector<float>{0, -2, 0, 10, 1, 0, 0, 20, 0, 0, 3, 30});
  header.replace(344, 3, "n+1");
  test::writeText(folder / "a.nii", header + "\3\4");
  const VolumeGrid grid = converted(folder, "a.nii");
  EXPECT_EQ(valueAt(grid.volume, {1, 0, 0}), 4.0f);
  EXPECT_THAT(grid.descriptor.transform.affine.value(),
              testing::ElementsAre(0, 1, 0, 0, -2, 0, 0, 0, 0, 0, 3, 0, 10, 20, 30, 1));
}
#endif

#if ESVR_HAS_VTI
/// Two points of one number, and two of a vector.
constexpr const char* kVti =
    "<VTKFile type=\"ImageData\" version=\"0.1\" byte_order=\"LittleEndian\"><ImageData "
    "WholeExtent=\"0 1 0 0 0 0\" Origin=\"5 6 7\" Spacing=\"1 2 3\"><Piece Extent=\"0 1 0 0 0 "
    "0\"><PointData Scalars=\"p\"><DataArray type=\"Float32\" Name=\"p\" format=\"ascii\">0.5 1"
    "</DataArray><DataArray type=\"Int8\" Name=\"v\" NumberOfComponents=\"3\" format=\"ascii\">1 "
    "2 3 4 5 6</DataArray></PointData></Piece></ImageData></VTKFile>";

TEST(Image2Vdb, bringsInVtiWithABackground) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.vti", kVti);
  const VolumeGrid grid = converted(folder, "a.vti", {"--background", "1"});
  EXPECT_EQ(activeVoxelCount(grid.volume), 1u);
  EXPECT_EQ(valueAt(grid.volume, {0, 0, 0}), 0.5f);
  EXPECT_EQ(valueAt(grid.volume, {9, 9, 9}), 1.0f);
  EXPECT_EQ(grid.descriptor.transform.affine.value()[14], 7.0);
}

TEST(Image2Vdb, bringsInAComponentThatIsChosen) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.vti", kVti);
  const auto grid = converted(folder, "a.vti", {"--dataset", "v", "--component", "2"});
  EXPECT_EQ(valueAt(grid.volume, {0, 0, 0}), 3.0f);
  EXPECT_EQ(valueAt(grid.volume, {1, 0, 0}), 6.0f);
}
#endif

#if ESVR_HAS_HDF5
TEST(Image2Vdb, bringsInADatasetThatIsChosen) {
  const TemporaryFolder folder;
  {
    samples::Hdf5Writer file(folder / "a.h5");
    file.addBytes("/x", {1, 1, 2}, "\1\2");
    file.addBytes("/y", {1, 1, 2}, "\3\4");
  }
  EXPECT_EQ(valueAt(converted(folder, "a.h5", {"--dataset", "/y"}).volume, {1, 0, 0}), 4.0f);
  const auto run = runProgram(IMAGE2VDB, {folder / "a.h5", folder / "b.vdb"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("/x (1 x 1 x 2 uint8), /y"));
}
#endif

TEST(Image2Vdb, saysInItsHelpWhatThisBuildReads) {
  const std::string help = runProgram(IMAGE2VDB, {"--help"}).out;
  EXPECT_THAT(help, HasSubstr("This build reads RAW, NRRD"));
  for (const auto format : {samples::ImageFormat::kTiff, samples::ImageFormat::kNifti,
                            samples::ImageFormat::kVti, samples::ImageFormat::kHdf5})
    EXPECT_THAT(help, HasSubstr(samples::nameOf(format)));
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
        RawRefusal{"a.nrrd", kFlatNrrd, {"--dims", "1,1,1"}, 2, "--dims is for RAW"},
        RawRefusal{"a.nrrd", kFlatNrrd, {"--dataset", "x"}, 2, "--dataset is for HDF5"},
        RawRefusal{"a.nrrd", kFlatNrrd, {"--component", "1"}, 2, "--component must be 0"},
        RawRefusal{"a.raw", ramp(), rampAnd({"--voxel-size", "1,2"}), 2, "--voxel-size"},
        RawRefusal{"a.tif", "no TIFF", {}, 3, "a.tif"},
        RawRefusal{"a.nii", "no NIfTI", {}, 3, "a.nii"},
        RawRefusal{"a.vti", "no XML", {}, 3, "a.vti"},
        RawRefusal{"a.h5", "no HDF5", {}, 3, "a.h5"}));

TEST(Image2Vdb, takesSeveralFilesOnlyOfTiff) {
  const TemporaryFolder folder;
  for (const char* name : {"a.raw", "b.raw"}) test::writeText(folder / name, ramp());
  const auto run = runProgram(IMAGE2VDB, {folder / "a.raw", folder / "b.raw", folder / "c.vdb"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("only TIFF images"));
  EXPECT_EQ(runProgram(IMAGE2VDB, {folder / "a.raw"}).exitCode, 2) << "the output is missing";
}

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
