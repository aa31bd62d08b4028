// Plan: grids of one file that are alike take fewer bytes together than apart, at the quality that
// was asked for, and the report and the summary say what that saved. --share off writes the file as
// if there were one grid after the other. One grid can be read back without the others. Single grids
// have goals of their own. Names that do not exist and goals that exclude each other are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using test::softBall;
using testing::AllOf;
using testing::HasSubstr;
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
    options.insert(options.begin(), {in(), out(), "--device", "cpu", "--force", "--representation",
                                     "voxels", "--report", folder_ / "r.json"});
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
      folder_ / "in.####.vdb", out(),    "--frames", "1-3",    "--device", "cpu",
      "--representation",      "voxels", "--force",  "--share"};
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

TEST_F(SharingGrids, keepToTheirOwnGoalsWhileTheyShare) {
  constexpr double kBound = 0.02;
  const Json report = convert({"--psnr", "heat=50", "--max-error", "density=0.02"});
  const Json& grids = report["grids"];
  EXPECT_LE(grids[0]["metrics"]["max_error"], kBound);
  EXPECT_GE(grids[1]["metrics"]["psnr_box"], 50.0);
  EXPECT_GE(grids[2]["metrics"]["psnr_active"], kStandardPsnr);
  EXPECT_EQ(report["asked"]["goals"].size(), 2u);
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

}  // namespace
}  // namespace esvr
