// Plan: grids of one file that are alike take fewer bytes together than apart, at the quality that
// was asked for, and the report and the summary say what that saved. --share off writes the file
// as if there were one grid after the other. One grid can be read back without the others. Single
// grids have goals of their own. Names that do not exist and goals that exclude each other are
// refused. vdb2esvr converts and stores grids with the same voxels once. Each comes back with its
// own name, transform and metadata. What is shared and when is tested in tests/encode/convert_file_test.cpp.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using test::InputGrid;
using test::InputMap;
using test::InputVoxel;
using test::quickFit;
using test::softBall;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using Json = nlohmann::json;
using Arguments = std::vector<std::string>;

constexpr double kStandardPsnr = 40.0;

class SharingGrids : public testing::Test {
 protected:
  void SetUp() override {
    test::writeInput(in(), {{.name = "density", .voxels = softBall({})},
                            {.name = "heat", .voxels = softBall({}, 40.0f)},
                            {.name = "far", .voxels = softBall({40, 0, 0}, 2.0f)}});
  }

  test::ProgramRun run(Arguments options) const {
    options.insert(options.begin(),
                   {in(), out(), "--device", "cpu", "--force", "--representation", "voxels",
                    "--measure", "values", "--report", folder_ / "r.json"});
    return test::vdb2esvr(options);
  }
  /// \return the report
  Json convert(const Arguments& options = {}) {
    run_ = run(options);
    EXPECT_EQ(run_.exitCode, 0) << run_.err;
    return Json::parse(test::readText(folder_ / "r.json"));
  }
  [[nodiscard]] std::string in() const { return folder_ / "in.vdb"; }
  [[nodiscard]] std::string out() const { return folder_ / "out.esvr"; }
  [[nodiscard]] std::uint64_t outBytes() const { return std::filesystem::file_size(out()); }

  test::TemporaryFolder folder_;
  test::ProgramRun run_;
};

TEST_F(SharingGrids, takeFewerBytesWithTheSameQuality) {
  convert({"--share", "off"});
  const std::uint64_t apart = outBytes();
  EXPECT_EQ(inspectEsvr(out()).versionMinor, 0);
  const Json report = convert();
  EXPECT_LT(3 * outBytes(), 2 * apart);
  EXPECT_EQ(inspectEsvr(out()).versionMinor, 4);
  EXPECT_EQ(readEsvr(out()).grids[1].reference->grid, std::size_t{0});
  for (const Json& grid : report["grids"]) EXPECT_GE(grid["metrics"]["psnr_active"], kStandardPsnr);
}

TEST_F(SharingGrids, areNamedByTheReportAndTheSummary) {
  convert({"--share", "off"});
  const std::uint64_t apart = outBytes();
  const Json report = convert(), heat = report["grids"][1];
  EXPECT_EQ(report["asked"]["share"], "auto");
  EXPECT_EQ(heat["shared"]["with"], "density");
  EXPECT_LT(heat["shared"]["bytes_with"], heat["shared"]["bytes_without"]);
  // The padding of the last section is counted.
  EXPECT_GE(report["output"]["bytes_separate"], apart);
  EXPECT_LT(report["output"]["bytes_separate"], apart + 8);
  EXPECT_THAT(run_.out, AllOf(HasSubstr("heat: refers to density"), HasSubstr("bytes smaller")));
}

TEST_F(SharingGrids, areReadOneByOne) {
  convert();
  const std::string back = folder_ / "back.vdb", all = folder_ / "all.vdb";
  ASSERT_EQ(test::esvr2vdb({out(), back, "-g", "heat"}).exitCode, 0);
  ASSERT_EQ(test::esvr2vdb({out(), all}).exitCode, 0);
  EXPECT_EQ(inspectVdb(back).grids.size(), 1u);
  EXPECT_EQ(readGrid(back, "heat").volume.values, readGrid(all, "heat").volume.values);
  EXPECT_EQ(test::esvr2vdb({"--check", out()}).exitCode, 0);
  EXPECT_THAT(test::esvr2vdb({"--list", out()}).out,
              AllOf(HasSubstr("related voxels"), HasSubstr("grid records")));
  EXPECT_THAT(test::esvr2vdb({"--list", "-v", out()}).out, HasSubstr("voxels refer to density"));
}

TEST_F(SharingGrids, thatDoNotExistAreRefused) {
  for (const Arguments& options : {Arguments{"--psnr", "smoke=40"}, {"--max-error", "smoke=1%"}}) {
    const auto run = this->run(options);
    EXPECT_EQ(run.exitCode, 3) << options[0];
    EXPECT_THAT(run.err, AllOf(HasSubstr("smoke"), HasSubstr("\"density\", \"heat\"")));
  }
}

TEST_F(SharingGrids, keepToASizeApart) {
  const Json report = convert({"--size", "2000"});
  EXPECT_LE(outBytes(), 2000u);
  EXPECT_TRUE(report["output"]["bytes_separate"].is_null());
}

TEST_F(SharingGrids, takeFewerBytesInTheFramesOfAFile) {
  for (int frame = 1; frame <= 3; ++frame)
    test::writeInput(folder_ / ("in.000" + std::to_string(frame) + ".vdb"),
                     {{.name = "density", .voxels = softBall({frame, 0, 0})},
                      {.name = "heat", .voxels = softBall({frame, 0, 0}, 40.0f)}});
  const Arguments command{
      folder_ / "in.####.vdb", out(),    "--frames", "1-3",       "--device", "cpu",
      "--representation",      "voxels", "--force",  "--measure", "values",   "--share"};
  std::vector<std::uint64_t> bytes;
  for (const char* share : {"off", "auto"}) {
    Arguments arguments = command;
    arguments.emplace_back(share);
    const auto run = test::vdb2esvr(arguments);
    ASSERT_EQ(run.exitCode, 0) << run.err;
    bytes.push_back(outBytes());
  }
  EXPECT_LT(bytes[1], bytes[0]);
  ASSERT_EQ(test::esvr2vdb({out(), folder_ / "back.####.vdb"}).exitCode, 0);
  const VolumeGrid source = readGrid(folder_ / "in.0003.vdb", "heat"),
                   found = readGrid(folder_ / "back.0003.vdb", "heat");
  EXPECT_GE(compareVolumes(source.volume, found.volume).psnrActive, kStandardPsnr);
}

TEST_F(SharingGrids, mayHaveGoalsOfTheirOwn) {
  const Json report = convert({"--psnr", "30,heat=50", "--share", "off"});
  const Json &density = report["grids"][0]["metrics"], &heat = report["grids"][1]["metrics"];
  EXPECT_GE(density["psnr_box"], 30.0);
  EXPECT_LT(density["psnr_box"], 40.0);
  EXPECT_GE(heat["psnr_box"], 50.0);
  EXPECT_EQ(report["asked"]["psnr"], 30.0);
  EXPECT_EQ(report["asked"]["goals"][0]["grid"], "heat");
}

TEST_F(SharingGrids, withTwoGoalsAreRefused) {
  for (const Arguments& options : {Arguments{"--psnr", "heat=40,heat=50"},
                                   {"--psnr", "heat=40", "--max-error", "heat=1%"},
                                   {"--psnr", "40", "--max-error", "1%"},
                                   {"--psnr", "40,50"},
                                   {"--psnr", "=40"},
                                   {"--psnr", "heat=warm"},
                                   {"--psnr", "heat=1000"},
                                   {"--max-error", "heat=0"},
                                   {"--psnr", "heat=40", "--size", "5000"},
                                   {"--psnr", "heat=40", "--count", "10"}})
    EXPECT_EQ(run(options).exitCode, 2) << testing::PrintToString(options);
}

using Json = nlohmann::json;

/// Bytes of the name, the transform, the metadata and the rows of a grid at most.
constexpr std::uint64_t kBytesOfATwin = 600;

class Twins : public testing::Test {
 protected:
  /// Runs vdb2esvr for these grids. \return the report
  Json convert(const std::vector<InputGrid>& grids, std::vector<std::string> options) {
    test::writeInput(in(), grids);
    const std::string report = folder_ / "r.json";
    options.insert(options.begin(),
                   {in(), out(), "--device", "cpu", "--force", "--report", report});
    run_ = test::vdb2esvr(options);
    EXPECT_EQ(run_.exitCode, 0) << run_.err;
    return Json::parse(test::readText(report));
  }
  [[nodiscard]] std::string in() const { return folder_ / "in.vdb"; }
  [[nodiscard]] std::string out() const { return folder_ / "out.esvr"; }
  [[nodiscard]] std::uint64_t outBytes() const { return std::filesystem::file_size(out()); }

  test::TemporaryFolder folder_;
  test::ProgramRun run_;
};

const std::vector<std::string> kQuick{"--count",          "30",        "--iterations", "60",
                                      "--representation", "ellipsoids"};

/// Three grids, of which the first and the last one have the same voxels.
std::vector<InputGrid> twoAlike() {
  return {{.name = "red", .voxels = softBall({})},
          {.name = "heat", .voxels = softBall({}, 2.0f)},
          {.name = "green", .voxels = softBall({}), .map = InputMap::kRotated}};
}

TEST_F(Twins, addTheirDescriptorsOnly) {
  for (const auto& options : {kQuick, std::vector<std::string>{"--lossless"}}) {
    const std::vector<InputGrid> grids = twoAlike();
    convert({grids[0], grids[1]}, options);
    const std::uint64_t without = outBytes();
    convert(grids, options);
    EXPECT_LT(outBytes(), without + kBytesOfATwin) << options[0];
    EXPECT_THAT(readEsvr(out()).grids, testing::SizeIs(3));
  }
}

TEST_F(Twins, comeBackWithTheirOwnDescriptors) {
  convert(twoAlike(), {"--lossless"});
  const std::string back = folder_ / "back.vdb";
  ASSERT_EQ(test::esvr2vdb({out(), back}).exitCode, 0);
  for (const char* name : {"red", "heat", "green"}) {
    const VolumeGrid source = readGrid(in(), name), found = readGrid(back, name);
    EXPECT_EQ(found.descriptor, source.descriptor) << name;
    EXPECT_EQ(found.volume.values, source.volume.values) << name;
    EXPECT_EQ(found.volume.active, source.volume.active) << name;
  }
}

TEST_F(Twins, areNamedByTheReportAndTheSummary) {
  const Json grids = convert(twoAlike(), kQuick)["grids"];
  EXPECT_TRUE(grids[0]["same_as"].is_null());
  EXPECT_TRUE(grids[1]["same_as"].is_null());
  EXPECT_EQ(grids[2]["same_as"], "red");
  EXPECT_EQ(grids[2]["metrics"], grids[0]["metrics"]);
  EXPECT_EQ(grids[2]["seconds"]["optimise"], 0.0);
  EXPECT_LT(grids[2]["bytes"], grids[0]["bytes"]);
  EXPECT_EQ(grids[2]["sections"][0]["shared"], true);
  EXPECT_THAT(run_.out,
              AllOf(HasSubstr("green: stored once with red"), Not(HasSubstr("heat: stored"))));
}

TEST_F(Twins, areListedWithoutCountingTheirBytesTwice) {
  const Json grids = convert(twoAlike(), {"--lossless"})["grids"];
  const auto list = test::esvr2vdb({"--list", out()});
  EXPECT_THAT(list.out, HasSubstr("shared with"));
  std::uint64_t sum = 0;
  for (const Json& grid : grids) sum += grid["bytes"].get<std::uint64_t>();
  EXPECT_LT(sum, outBytes());
  EXPECT_THAT(list.out, HasSubstr(" " + grids[2]["bytes"].dump() + " "));
}

TEST_F(Twins, ofATwinAreNamedAfterTheFirst) {
  const InputGrid ball{.voxels = softBall({})};
  const Json grids = convert({ball, ball, ball}, kQuick)["grids"];
  EXPECT_EQ(grids[1]["same_as"], "density[0]");
  EXPECT_EQ(grids[2]["same_as"], "density[0]");
}

TEST_F(Twins, RealFileHasThreeColoursInTheBytesOfOne) {
  if (std::string(ESVR_DATA_DIR).empty())
    GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
  const std::string gas = std::string(ESVR_DATA_DIR) + "/sequence/gas_0001.vdb";
  const auto bytesOf = [&](const std::vector<std::string>& names) {
    std::vector<std::string> arguments{gas, out(), "--lossless", "--force"};
    for (const auto& name : names) arguments.insert(arguments.end(), {"-g", name});
    EXPECT_EQ(test::vdb2esvr(arguments).exitCode, 0);
    return outBytes();
  };
  const std::uint64_t one = bytesOf({"color_r"});
  EXPECT_LT(bytesOf({"color_r", "color_g", "color_b"}), one + 2 * kBytesOfATwin);
  const EsvrFile file = readEsvr(out());
  ASSERT_EQ(file.grids.size(), 3u);
  EXPECT_EQ(file.grids[2].descriptor.name, "color_b");
  EXPECT_EQ(decodeGrid(file.grids[2]).values, readGrid(gas, "color_b").volume.values);
}

}  // namespace
}  // namespace esvr
