// Plan: these tests cover the options of esvr-compare whose effect no other test shows. Each test
// compares the output with and without an option.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"
#include "esvr/baseline.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using test::softBall;
using testing::HasSubstr;

class CompareOption : public test::FolderTest {
 protected:
  void SetUp() override {
    auto off = softBall({});
    for (auto& voxel : off) voxel.value += 0.01f;
    test::writeInput(at("ref.vdb"), {{.voxels = softBall({})}, {.name = "heat", .voxels = off}});
    test::writeInput(at("off.vdb"), {{.voxels = off}, {.name = "heat", .voxels = off}});
    ASSERT_EQ(test::quickFit(at("ref.vdb"), at("fit.esvr")).exitCode, 0);
  }
  [[nodiscard]] Json run(const std::string& job, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), job);
    arguments.insert(arguments.end(), {"--report", "-"});
    const auto ran = test::runProgram(ESVR_COMPARE, arguments);
    EXPECT_EQ(ran.exitCode, 0) << ran.err;
    return Json::parse(ran.out, nullptr, false);
  }
  [[nodiscard]] Json check(std::vector<std::string> more) const {
    more.insert(more.begin(), {at("ref.vdb"), at("off.vdb")});
    return run("check", more);
  }
  [[nodiscard]] Json table(std::vector<std::string> more) const {
    more.insert(more.begin(), {at("ref.vdb"), at("fit.esvr"), "--runs", "1"});
    if (std::find(more.begin(), more.end(), "--row") == more.end())
      more.insert(more.end(), {"--rows", "none"});
    return run("table", more)["rows"][0];
  }
  /// Returns the points of a curve.
  [[nodiscard]] std::string curves(std::vector<std::string> more) const {
    more.insert(more.begin(), {"curves", at("ref.vdb"), at("fit.esvr"), "-o", at("c"),
                               "--no-baselines", "--force"});
    const auto ran = test::runProgram(ESVR_COMPARE, more);
    EXPECT_EQ(ran.exitCode, 0) << ran.err;
    return Json::parse(test::readText(at("c.json")))["points"].back().dump();
  }
};

TEST_F(CompareOption, checkTakesTheGridTheBoxAndThePeak) {
  EXPECT_EQ(check({})["grids"].size(), 2u);
  EXPECT_EQ(check({"--grid", "heat"})["grids"].size(), 1u);
  const auto psnr = [&](std::vector<std::string> more) {
    more.insert(more.end(), {"--grid", "density"});
    return check(more)["grids"][0]["psnr_box"].get<double>();
  };
  const double usual = psnr({});
  EXPECT_NEAR(psnr({"--peak", "10"}), usual + 20.0, 1e-6) << "ten times the peak";
  EXPECT_GT(psnr({"--box", "-40,-40,-40,40,40,40"}), usual) << "more voxels without error";
}

TEST_F(CompareOption, reportsAreReplacedWhereForced) {
  const std::vector<std::string> usual{"check", at("ref.vdb"), at("off.vdb"), "--report",
                                       at("r.json")};
  auto forced = usual;
  forced.emplace_back("--force");
  test::writeText(at("r.json"), "old");
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, usual).exitCode, 1);
  EXPECT_EQ(test::readText(at("r.json")), "old");
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, forced).exitCode, 0);
  EXPECT_THAT(test::readText(at("r.json")), HasSubstr("esvr-check"));
}

TEST_F(CompareOption, tableTakesTheGridTheBoxAndThePeak) {
  const Json usual = table({}), peak = table({"--peak", "10"});
  EXPECT_NEAR(peak["psnr_box"].get<double>(), usual["psnr_box"].get<double>() + 20.0, 1e-6);
  EXPECT_NE(table({"--grid", "heat"})["psnr_box"], usual["psnr_box"]);
  EXPECT_GT(table({"--box", "-40,-40,-40,40,40,40"})["psnr_box"].get<double>(),
            usual["psnr_box"].get<double>());
}

TEST_F(CompareOption, tablesPicturesTakeStepAndTransferFunctions) {
  const std::vector<std::string> pictures{"--images", "1", "--image-size", "24", "--device", "cpu"};
  const auto psnr = [&](std::vector<std::string> more) {
    more.insert(more.end(), pictures.begin(), pictures.end());
    return table(more)["image_psnr"].get<double>();
  };
  test::writeText(at("tf.json"),
                  R"([{"Name": "Red", "RGBPoints": [0, 1, 0, 0, 1, 1, 0.5, 0],
                      "Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}])");
  const double usual = psnr({});
  EXPECT_NE(psnr({"--image-step", "3"}), usual);
  EXPECT_NE(psnr({"--tf", at("tf.json")}), usual);
}

TEST_F(CompareOption, tablesAreReplacedWhereForced) {
  test::writeText(at("t.csv"), "old");
  const std::vector<std::string> usual{"table",  at("ref.vdb"), at("fit.esvr"), "--rows",   "none",
                                       "--runs", "1",           "--csv",        at("t.csv")};
  auto forced = usual;
  forced.emplace_back("--force");
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, usual).exitCode, 1);
  EXPECT_EQ(test::readText(at("t.csv")), "old");
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, forced).exitCode, 0);
  EXPECT_THAT(test::readText(at("t.csv")), HasSubstr("fit.esvr"));
}

TEST_F(CompareOption, curvesTakeTheGridTheBoxAndThePeak) {
  const std::string usual = curves({});
  EXPECT_NE(curves({"--peak", "10"}), usual);
  EXPECT_NE(curves({"--grid", "heat"}), usual);
  EXPECT_NE(curves({"--box", "-40,-40,-40,40,40,40"}), usual);
  EXPECT_EQ(curves({}), usual);
}

TEST_F(CompareOption, curvesAreReplacedWhereForced) {
  (void)curves({});
  const std::vector<std::string> arguments{"curves", at("ref.vdb"), at("fit.esvr"),
                                           "-o",     at("c"),       "--no-baselines"};
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, arguments).exitCode, 1);
}

TEST_F(CompareOption, maxDenseSkipsZfpInCurves) {
  const auto zfpPoints = [&](const char* bound) {
    const auto ran = test::runProgram(
        ESVR_COMPARE,
        {"curves", at("ref.vdb"), at("fit.esvr"), "--max-dense", bound, "-o", at("z"), "--force"});
    EXPECT_EQ(ran.exitCode, 0) << ran.err;
    int points = 0;
    const Json written = Json::parse(test::readText(at("z.json")));
    for (const auto& point : written["points"])
      points += point["series"].get<std::string>().starts_with("ZFP");
    return points;
  };
  if (zfpVersion().empty()) GTEST_SKIP() << "built without ZFP";
  EXPECT_GT(zfpPoints("1GB"), 0);
  EXPECT_EQ(zfpPoints("100"), 0);
}

}  // namespace
}  // namespace esvr
