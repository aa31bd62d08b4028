// Plan: these tests cover the options of vdb2esvr, esvr2vdb and esvr-compare whose effect no other test
// shows. Each test compares the output with and without an option.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/run_program.h"
#include "cli/vdb_inputs.h"
#include "esvr/baseline.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"
#include "support/on_device.h"

namespace esvr {
namespace {

using test::softBall;
using testing::AllOf;
using testing::HasSubstr;

using Json = nlohmann::json;

class Vdb2EsvrOption : public test::FolderTest {
 protected:
  void SetUp() override { test::writeInput(at("in.vdb"), {{.voxels = test::cloud(8)}}); }
  /// Converts to NAME and returns the report.
  [[nodiscard]] Json convert(std::vector<std::string> options,
                             const std::string& name = "out.esvr") const {
    options.insert(options.begin(), {at("in.vdb"), at(name), "--force", "--report", "-"});
    const auto run = test::vdb2esvr(options);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return Json::parse(run.out, nullptr, false);
  }
  /// Makes a fit that takes milliseconds, and returns the report of its grid.
  [[nodiscard]] Json quick(std::vector<std::string> options,
                           const std::string& name = "out.esvr") const {
    options.insert(options.end(), {"--iterations", "60", "--device", "cpu"});
    if (std::find(options.begin(), options.end(), "--representation") == options.end())
      options.insert(options.end(), {"--representation", "ellipsoids"});
    return convert(options, name)["grids"][0];
  }
};

TEST_F(Vdb2EsvrOption, countIsTheNumberOfEllipsoids) {
  EXPECT_EQ(quick({"--count", "7"})["ellipsoids"], 7);
  EXPECT_EQ(quick({"--count", "12"})["ellipsoids"], 12);
}

TEST_F(Vdb2EsvrOption, iterationsEndTheFit) {
  const Json grid =
      convert({"--count", "5", "--iterations", "33", "--representation", "ellipsoids"})["grids"][0];
  EXPECT_EQ(grid["curve"].back()["iteration"], 33);
}

TEST_F(Vdb2EsvrOption, effortLengthensTheFit) {
  const auto iterations = [&](const char* effort) {
    const Json grid =
        convert({"--count", "5", "--effort", effort, "--representation", "ellipsoids"})["grids"][0];
    return grid["curve"].back()["iteration"].get<int>();
  };
  EXPECT_LT(iterations("1"), iterations("5"));
  EXPECT_LT(iterations("5"), iterations("7"));
}

TEST_F(Vdb2EsvrOption, picturePsnrIsReached) {
  const Json coarse = quick({"--picture-psnr", "25"}), fine = quick({"--picture-psnr", "40"});
  EXPECT_EQ(fine["measured"], "pictures");
  EXPECT_GE(coarse["quality"]["psnr_t50"].get<double>(), 25.0);
  EXPECT_GE(fine["quality"]["psnr_t50"].get<double>(), 40.0);
  EXPECT_LT(coarse["bytes"].get<int>(), fine["bytes"].get<int>());
}

TEST_F(Vdb2EsvrOption, maxRelativeErrorHoldsAtEveryVoxel) {
  const auto bytes = [&](const char* bound) {
    return convert({"--max-relative-error", bound})["grids"][0]["bytes"].get<int>();
  };
  const int fine = bytes("1%"), coarse = bytes("10%");
  EXPECT_LT(coarse, fine);
  EXPECT_LT(bytes("1%,0.5"), fine);
  const auto source = readGrid(at("in.vdb"), 0).volume;
  const auto back = decodeGrid(readEsvr(at("out.esvr")).grids[0]);
  for (std::size_t b = 0; b < source.brickCount(); ++b)
    for (std::size_t v = 0; v < kBrickVoxels; ++v) {
      const double value = source.brickValues(b)[v];
      const auto other = findBrick(back, brickOf(source.brickCorner(b) - back.origin));
      const double made = other ? back.brickValues(*other)[v] : 0.0;
      ASSERT_LE(std::abs(made - value), 0.01 * std::max(std::abs(value), 0.5));
    }
  for (const char* text : {"0", "100%", "1%,0", "1%,x", "1%,1,2", "1e400"})
    EXPECT_EQ(test::vdb2esvr({at("in.vdb"), at("no.esvr"), "--max-relative-error", text}).exitCode,
              2)
        << text;
}

TEST_F(Vdb2EsvrOption, measureSaysWhatAPresetMeans) {
  const auto measured = [&](const char* measure) -> Json {
    return convert({"--measure", measure, "--representation", "ellipsoids"})["grids"][0];
  };
  const Json seen = measured("auto"), values = measured("values");
  EXPECT_EQ(seen["measured"], "pictures");
  EXPECT_EQ(values["measured"], "values");
  EXPECT_GE(seen["quality"]["psnr_t50"].get<double>(), 38.0);
  EXPECT_GE(values["metrics"]["psnr_active"].get<double>(), 40.0);
}

TEST_F(Vdb2EsvrOption, toneIsStored) {
  EXPECT_EQ(quick({"--tone", "0.125"})["tone"].get<float>(), 0.125f);
  EXPECT_EQ(readEsvr(at("out.esvr")).grids[0].tone.scale, 0.125f);
  EXPECT_TRUE(quick({"--tone", "off"})["tone"].is_null());
}

TEST_F(Vdb2EsvrOption, ratioBoundsTheFile) {
  const std::uintmax_t bytes = sizeOf("in.vdb");
  for (const char* ratio : {"4", "8"}) {
    (void)quick({"--ratio", ratio});
    EXPECT_LE(double(sizeOf("out.esvr")), double(bytes) / std::stod(ratio)) << ratio;
  }
}

TEST_F(Vdb2EsvrOption, sizeGoesToTheGridsThatNeedIt) {
  std::vector<test::InputVoxel> rough = test::cloud(9), constant;
  for (std::size_t i = 0; i < rough.size(); ++i)
    rough[i].value = float(i * 2654435761u % 997) / 997.0f;
  for (int v = 0; v < 32 * 32 * 32; ++v)
    constant.push_back({{v / 1024, v / 32 % 32, v % 32}, 0.7f});
  for (const bool first : {true, false}) {
    std::vector<test::InputGrid> grids{{.name = "rough", .voxels = rough},
                                       {.name = "constant", .voxels = constant}};
    if (!first) std::swap(grids[0], grids[1]);
    test::writeInput(at("in.vdb"), grids);
    const Json report = convert({"--size", "4000"});
    EXPECT_LE(sizeOf("out.esvr"), 4000u);
    EXPECT_GE(sizeOf("out.esvr"), 3800u);
    EXPECT_EQ(report["grids"][0]["name"], grids[0].name);
  }
}

TEST_F(Vdb2EsvrOption, psnrIsReached) {
  // By value, because the bytes of a mask are larger for coarser sums.
  const auto reaching = [&](const char* psnr) { return quick({"--psnr", psnr}); };
  const Json coarse = reaching("25"), fine = reaching("40");
  EXPECT_GE(coarse["metrics"]["psnr_box"].get<double>(), 25.0);
  EXPECT_GE(fine["metrics"]["psnr_box"].get<double>(), 40.0);
  EXPECT_LE(coarse["bytes"].get<int>(), fine["bytes"].get<int>());
}

TEST_F(Vdb2EsvrOption, representationIsTheOneWanted) {
  for (const std::string wanted : {"ellipsoids", "voxels"}) {
    const Json grid = quick({"--psnr", "35", "--representation", wanted});
    EXPECT_EQ(grid["representation"]["stored"], wanted);
    EXPECT_GE(grid["metrics"]["psnr_box"].get<double>(), 35.0);
  }
  const Json chosen = quick({"--psnr", "60", "--representation", "auto"})["representation"];
  const std::string other = chosen["stored"] == "voxels" ? "ellipsoids" : "voxels";
  EXPECT_LE(chosen[chosen["stored"].get<std::string>()]["bytes"], chosen[other]["bytes"]);
}

TEST_F(Vdb2EsvrOption, secondsEndTheFit) {
  const Json grid =
      convert({"--count", "20", "--iterations", "10000000", "--seconds", "0.2"})["grids"][0];
  EXPECT_EQ(grid["fit"]["end"], "time up");
}

TEST_F(Vdb2EsvrOption, chunkVoxelsDivideTheFit) {
  const Json one = quick({"--count", "40"}),
             several = quick({"--count", "40", "--chunk-voxels", "600"});
  EXPECT_EQ(one["fit"]["chunks"], 1);
  EXPECT_GT(several["fit"]["chunks"], 1);
  EXPECT_GT(several["metrics"]["psnr_box"], one["metrics"]["psnr_box"].get<double>() - 3.0);
}

TEST_F(Vdb2EsvrOption, presetsTakeMoreAndMoreIterations) {
  const auto last = [&](const char* preset) {
    const Json report =
        convert({"--preset", preset, "--count", "5", "--representation", "ellipsoids"});
    return report["grids"][0]["curve"].back()["iteration"].get<int>();
  };
  EXPECT_LT(last("draft"), last("standard"));
  EXPECT_LT(last("standard"), last("high"));
}

TEST_F(Vdb2EsvrOption, boxIsWherePsnrIsTaken) {
  const Json metrics = quick({"--count", "5", "--box", "-20,-20,-20,20,20,19"})["metrics"];
  EXPECT_EQ(metrics["box_voxels"], 41.0 * 41.0 * 40.0);
}

TEST_F(Vdb2EsvrOption, seedsGiveOtherFiles) {
  const auto bytes = [&](const char* seed) {
    (void)quick({"--count", "9", "--seed", seed});
    return test::readText(at("out.esvr"));
  };
  const std::string first = bytes("1");
  EXPECT_NE(bytes("2"), first);
  EXPECT_EQ(bytes("1"), first);
}

TEST_F(Vdb2EsvrOption, storageIsCompactOrFloat32) {
  const Json compact = quick({"--count", "40"}),
             floats = quick({"--count", "40", "--storage", "float32"});
  EXPECT_TRUE(compact["compact"].is_object());
  EXPECT_TRUE(floats["compact"].is_null());
  EXPECT_LT(compact["bytes"].get<int>(), floats["bytes"].get<int>());
}

TEST_F(Vdb2EsvrOption, devicesAreTakenAsNamed) {
  EXPECT_EQ(quick({"--count", "5"})["fit"]["device"], "CPU");
  const auto run = test::vdb2esvr({at("in.vdb"), at("none.esvr"), "--device", "cuda:77"});
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_FALSE(std::filesystem::exists(at("none.esvr")));
}

TEST_F(Vdb2EsvrOption, maxVramBoundsTheDevicesMemoryOnGpu) {
  Device gpu;
  test::selectOrSkip("cuda", gpu);
  if (IsSkipped()) return;
  const std::vector<std::string> onGpu{"--device", "cuda", "--max-vram"};
  const auto convert = [&](const char* input, std::vector<std::string> options) {
    options.insert(options.begin(), onGpu.begin(), onGpu.end());
    options.insert(options.begin(), {at(input), at("out.esvr"), "--report", at("out.json")});
    return test::vdb2esvr(options);
  };
  // The bricks of the large cloud take more than 1 MB; all ellipsoids of the small one more than 3.
  test::writeInput(at("large.vdb"), {{.voxels = test::cloud(24)}});
  test::writeInput(at("small.vdb"), {{.voxels = test::cloud(12)}});
  EXPECT_EQ(convert("large.vdb", {"0.001"}).exitCode, 5);
  const auto run = convert("small.vdb", {"0.003", "--count", "5000", "--iterations", "50", "-f"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("GPU was full"), HasSubstr("instead of 5000")));
  const Json fit = Json::parse(test::readText(at("out.json")))["grids"][0]["fit"];
  EXPECT_EQ(fit["device_full"], true);
  EXPECT_EQ(fit["wanted"], 5000);
}

class Esvr2VdbOption : public test::FolderTest {
 protected:
  /// A cube of 16^3 equal voxels, stored losslessly, which a tree can hold as tiles.
  void SetUp() override {
    std::vector<test::InputVoxel> cube;
    for (int v = 0; v < 4096; ++v) cube.push_back({{v / 256, v / 16 % 16, v % 16}, 1.0f});
    test::writeInput(at("in.vdb"), {{.voxels = cube}});
    ASSERT_EQ(test::vdb2esvr({at("in.vdb"), at("in.esvr"), "--lossless"}).exitCode, 0);
  }
  [[nodiscard]] test::ProgramRun decode(const std::string& name,
                                        std::vector<std::string> more) const {
    more.insert(more.begin(), {at("in.esvr"), at(name)});
    auto run = test::esvr2vdb(more);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return run;
  }
};

TEST_F(Esvr2VdbOption, noTilesWritesLeaves) {
  constexpr int kSide = 72;  // small grids keep their leaves for Blender
  std::vector<test::InputVoxel> cube;
  for (int v = 0; v < kSide * kSide * kSide; ++v)
    cube.push_back({{v / (kSide * kSide), v / kSide % kSide, v % kSide}, 1.0f});
  test::writeInput(at("in.vdb"), {{.voxels = cube}});
  ASSERT_EQ(test::vdb2esvr({at("in.vdb"), at("in.esvr"), "--lossless", "--force"}).exitCode, 0);
  (void)decode("tiles.vdb", {});
  (void)decode("leaves.vdb", {"--no-tiles"});
  EXPECT_GT(sizeOf("leaves.vdb"), sizeOf("tiles.vdb"));
  EXPECT_EQ(readGrid(at("leaves.vdb"), "density").volume.values,
            readGrid(at("tiles.vdb"), "density").volume.values);
}

TEST_F(Esvr2VdbOption, boxIsWherePsnrIsTaken) {
  ASSERT_EQ(test::quickFit(at("in.vdb"), at("in.esvr"), {"--force"}).exitCode, 0);
  const std::vector<std::string> compared{"--reference", at("in.vdb")};
  const auto usual = decode("a.vdb", compared);
  const auto larger = decode("b.vdb", {"--reference", at("in.vdb"), "--box", "0,0,0,99,99,99"});
  EXPECT_NE(usual.out, larger.out);
}

using Json = nlohmann::json;

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
