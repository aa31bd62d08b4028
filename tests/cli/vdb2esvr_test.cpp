// Plan: vdb2esvr is run as a separate process with one small grid. The tests check what it prints,
// and that the file has the size, the error or the voxels of the goal, on any number of threads.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/vdb2esvr_fixture.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using test::quickFit;
using test::softBall;
using test::Vdb2Esvr;
using test::vdb2esvr;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST_F(Vdb2Esvr, printsATableAndWritesTheFile) {
  const auto run = fitQuickly();
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("PSNR box"), HasSubstr("density"), HasSubstr("bytes, 1 :")));
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "out.esvr"));
}

TEST_F(Vdb2Esvr, saysWhereExactVoxelsWouldTakeFewerBytes) {
  test::writeInput(in(), {{.voxels = test::cloud(8)}});
  const auto summaryOf = [&](const char* count) {
    return vdb2esvr({in(), out(), "--force", "--iterations", "5", "--count", count, "--storage",
                     "float32", "--topology", "threshold"})
        .out;
  };
  EXPECT_THAT(summaryOf("10"), Not(HasSubstr("exact voxels")));
  EXPECT_THAT(summaryOf("5000"), HasSubstr("exact voxels would take fewer bytes, about "));
}

TEST_F(Vdb2Esvr, listsTheKeysOfThePapersMethod) {
  const auto run = vdb2esvr({"--help", "paper"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("epochs (=2800)"), HasSubstr("prune-score (=full)")));
}

TEST_F(Vdb2Esvr, endsWithCodeFourWhereThePsnrIsMissedAndWritesTheFile) {
  const auto run = fitQuickly({"--psnr", "200"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, AllOf(HasSubstr("instead of 200.00 dB"), HasSubstr("was written")));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

TEST_F(Vdb2Esvr, keepsToTheSizeAskedFor) {
  const auto run = vdb2esvr(
      {in(), out(), "--size", "1.5KB", "--iterations", "60", "--representation", "ellipsoids"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LE(std::filesystem::file_size(out()), 1500u);
  EXPECT_GE(std::filesystem::file_size(out()), 1470u);
}

TEST_F(Vdb2Esvr, losslessGivesBackEveryBit) {
  const auto run = vdb2esvr({in(), out(), "--lossless"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const SparseVolume source = readGrid(in(), "density", {}).volume;
  const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
  EXPECT_EQ(back.values, source.values);
  EXPECT_EQ(back.active, source.active);
}

TEST_F(Vdb2Esvr, keepsEveryVoxelWithinTheBound) {
  const auto run = vdb2esvr({in(), out(), "--max-error", "1%", "--topology", "exact"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const SparseVolume source = readGrid(in(), "density", {}).volume;
  const ValueRange range = activeRange(source);
  const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
  EXPECT_LE(compareVolumes(source, back).maxError, 0.01 * (double(range.max) - range.min));
  EXPECT_EQ(back.active, source.active);
}

TEST_F(Vdb2Esvr, storesTheMaskWhereAsked) {
  ASSERT_EQ(fitQuickly({"--topology", "exact"}).exitCode, 0);
  const SparseVolume source = readGrid(in(), "density").volume;
  const StoredGrid grid = readEsvr(out()).grids[0];
  EXPECT_GT(grid.field.ellipsoidCount(), 0u);
  const SparseVolume back = decodeGrid(grid);
  EXPECT_EQ(back.bricks, source.bricks);
  EXPECT_EQ(back.active, source.active);
}

/// A ball in a cloud with a rough boundary, which is too faint for a threshold.
std::vector<test::InputVoxel> ballInACloud() {
  std::vector<test::InputVoxel> voxels;
  for (Coord v; v.x < 40; ++v.x)
    for (v.y = 0; v.y < 40; ++v.y)
      for (v.z = 0; v.z < 40; ++v.z) {
        const double r = std::hypot(v.x - 20.0, v.y - 20.0, v.z - 20.0);
        if (r < 6.0)
          voxels.push_back({v, float(7.0 - r)});
        else if (r < 16.0 + std::sin(2.0 * v.x) + std::sin(3.0 * v.y + v.z))
          voxels.push_back({v, 1e-4f});
      }
  return voxels;
}

TEST_F(Vdb2Esvr, saysWhatAMaskTakesAndWhereASizeHasNoRoomForIt) {
  test::writeInput(in(), {{.voxels = ballInACloud()}});
  const std::string report = folder_ / "report.json";
  const auto run = fitQuickly({"--report", report});
  EXPECT_THAT(run.out, HasSubstr("density: a simplified mask of active voxels takes "));
  const Json topology = Json::parse(test::readText(report))["grids"][0]["topology"];
  EXPECT_EQ(topology["kind"], "mask");
  EXPECT_GT(topology["mask_bytes"].get<int>(), 0);
  EXPECT_TRUE(topology["threshold"].is_null());
  const auto small = vdb2esvr({in(), out(), "--force", "--size", "1500", "--iterations", "20"});
  EXPECT_THAT(small.out, HasSubstr("a mask of active voxels would take too much of the size"))
      << small.err;
}

/// A cloud that is cut off at a value which grows along x.
std::vector<test::InputVoxel> cutCloud() {
  std::vector<test::InputVoxel> voxels;
  for (Coord v; v.x < 48; ++v.x)
    for (v.y = 0; v.y < 32; ++v.y)
      for (v.z = 0; v.z < 32; ++v.z) {
        const double value = std::exp(
            -(std::pow(v.x - 24.0, 2) / 4 + std::pow(v.y - 16.0, 2) + std::pow(v.z - 16.0, 2)) /
            50.0);
        if (value > 0.005 * std::exp2(v.x / 8.0)) voxels.push_back({v, float(value)});
      }
  return voxels;
}

TEST_F(Vdb2Esvr, saysWhatThresholdsOfBlocksTake) {
  test::writeInput(in(), {{.voxels = cutCloud()}});
  const std::string report = folder_ / "report.json";
  const auto run =
      vdb2esvr({in(), out(), "--psnr", "45", "--representation", "ellipsoids", "--report", report});
  EXPECT_THAT(run.out, HasSubstr("density: thresholds of blocks take ")) << run.err;
  const Json grid = Json::parse(test::readText(report))["grids"][0];
  EXPECT_EQ(grid["topology"]["kind"], "blocks");
  EXPECT_GT(grid["topology"]["level_bytes"].get<int>(), 0);
  EXPECT_TRUE(grid["topology"]["threshold"].is_null());
  EXPECT_GT(grid["metrics"]["iou"].get<double>(), 0.95);
  EXPECT_GE(grid["metrics"]["psnr_box"].get<double>(), 45.0);
}

TEST_F(Vdb2Esvr, givesTheSameBytesInEveryRunOnAnyNumberOfThreads) {
  const std::string other = folder_ / "other.esvr";
  ASSERT_EQ(fitQuickly({"--threads", "1"}).exitCode, 0);
  for (const char* threads : {"1", "3"}) {
    ASSERT_EQ(quickFit(in(), other, {"--threads", threads, "--force"}).exitCode, 0);
    EXPECT_EQ(test::readText(other), test::readText(out())) << threads << " threads";
  }
}

TEST_F(Vdb2Esvr, storesVoxelsForABound) {
  const std::string report = folder_ / "r.json";
  const auto run = vdb2esvr({in(), out(), "--max-error", "5%", "--report", report});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Json made = Json::parse(test::readText(report))["grids"][0]["representation"];
  EXPECT_EQ(made["stored"], "voxels");
  EXPECT_TRUE(made["ellipsoids"].is_null());
  EXPECT_TRUE(readEsvr(out()).grids[0].voxels.has_value());
  const auto refused =
      vdb2esvr({in(), out(), "--force", "--max-error", "5%", "--representation", "ellipsoids"});
  EXPECT_EQ(refused.exitCode, 2);
  EXPECT_THAT(refused.err, HasSubstr("store voxels"));
}

}  // namespace
}  // namespace esvr
