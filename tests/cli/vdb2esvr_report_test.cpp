// Plan: the JSON report of a run is compared with the file that the run wrote, with the voxels that
// come back from this file, and with the options. A run that fails has a report, too.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/vdb2esvr_fixture.h"
#include "esvr/container.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using test::softBall;
using test::Vdb2Esvr;
using test::vdb2esvr;
using testing::HasSubstr;

TEST_F(Vdb2Esvr, reportsWhatTheFileHolds) {
  const auto run = fitQuickly({"--report", "-"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Json report = Json::parse(run.out);
  EXPECT_TRUE(report["error"].is_null());
  const Json& grid = report["grids"][0];
  EXPECT_TRUE(grid["paper"].is_null());
  EXPECT_EQ(report["schema"], "esvr-report");
  EXPECT_EQ(report["exit_code"], 0);
  EXPECT_EQ(report["output"]["bytes"], std::filesystem::file_size(out()));
  EXPECT_EQ(grid["ellipsoids"], readEsvr(out()).grids[0].field.ellipsoidCount());
  EXPECT_EQ(grid["source"]["active_voxels"], softBall({}).size());
  EXPECT_EQ(grid["curve"].size(), readEsvr(out()).grids[0].curve.size());
}

TEST_F(Vdb2Esvr, reportsWhatThePapersMethodUsed) {
  const auto run = vdb2esvr({in(), out(), "--paper", "epochs=28,points=60,beta=0.5", "--paper",
                             "prune-score=no-fa,densify-threshold=0,rates=1e-4:2e-3:1e-3:1e-2",
                             "--count", "40", "--report", "-", "--device", "cpu"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Json report = Json::parse(run.out);
  EXPECT_EQ(report["asked"]["method"], "paper");
  EXPECT_EQ(report["asked"]["storage"], "float32");
  const Json& paper = report["grids"][0]["paper"];
  EXPECT_EQ(paper["k"], 5.0);
  EXPECT_EQ(paper["kernel"], "ellipsoid");
  EXPECT_EQ(paper["beta"], 0.5);
  EXPECT_EQ(paper["points"], 60);
  EXPECT_EQ(paper["rates"]["scale"], 2e-3);
  EXPECT_EQ(paper["prune_score"], "no-fa");
  EXPECT_EQ(paper["densify"]["until"], 4);  // 400 of 2800 epochs in the paper
  EXPECT_EQ(paper["prunes"][0]["epoch"], 12);
  EXPECT_EQ(paper["prunes"][0]["after"], 40);
  EXPECT_GT(paper["prunes"][0]["hits_before"], 1.0);
  EXPECT_GT(paper["hits"], 1.0);
}

TEST_F(Vdb2Esvr, dividesByTheGridsThatWereConverted) {
  test::writeInput(in(), {{.name = "density", .voxels = softBall({})},
                          {.name = "heat", .voxels = softBall({40, 0, 0})}});
  const std::string path = folder_ / "r.json";
  const auto run = fitQuickly({"-g", "heat", "--report", path});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("1 of 2 grids"));
  const Json report = Json::parse(test::readText(path));
  const double converted = report["input"]["bytes_converted"], all = report["input"]["bytes"];
  EXPECT_LT(converted, 0.6 * all);  // two equal grids
  EXPECT_GT(converted, 0.2 * all);
  EXPECT_DOUBLE_EQ(report["ratio"], converted / double(report["output"]["bytes"]));
}

TEST_F(Vdb2Esvr, reportsAFailureToo) {
  const std::string report = folder_ / "r.json";
  const auto run = vdb2esvr({in(), out(), "--size", "99", "--report", report});
  ASSERT_EQ(run.exitCode, 2);
  const Json json = Json::parse(test::readText(report));
  EXPECT_EQ(json["exit_code"], 2);
  EXPECT_EQ(json["error"]["kind"], "usage");
  EXPECT_THAT(std::string(json["error"]["message"]), HasSubstr("99"));
  EXPECT_EQ(json["input"]["path"], in());
}

TEST_F(Vdb2Esvr, reportsNullForAPsnrWithoutError) {
  test::writeInput(in(), {{.voxels = softBall({}, 0.0f)}});
  const std::string report = folder_ / "r.json";
  ASSERT_EQ(fitQuickly({"--report", report}).exitCode, 0);
  const Json json = Json::parse(test::readText(report));
  EXPECT_TRUE(json["grids"][0]["metrics"]["psnr_box"].is_null());
}

TEST_F(Vdb2Esvr, reportsTheErrorOfTheVoxelsThatComeBack) {
  const auto run = fitQuickly({"--report", "-"});
  const Json metrics = Json::parse(run.out)["grids"][0]["metrics"];
  const std::string back = folder_ / "back.vdb";
  ASSERT_EQ(test::esvr2vdb({out(), back}).exitCode, 0);
  const VolumeMetrics m =
      compareVolumes(readGrid(in(), "density").volume, readGrid(back, "density").volume);
  EXPECT_EQ(metrics["psnr_box"].get<double>(), m.psnrBox);
  EXPECT_EQ(metrics["psnr_active"].get<double>(), m.psnrActive);
  EXPECT_EQ(metrics["max_error"].get<double>(), m.maxError);
  EXPECT_EQ(metrics["iou"].get<double>(), m.iou);
}

}  // namespace
}  // namespace esvr
