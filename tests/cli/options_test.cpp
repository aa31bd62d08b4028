// Plan: the tests cover the options that all programs share, and those options of the converters
// and of esvr-compare whose effect no other test shows. Each is tested by the change in the output.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"
#include "esvr/baseline.h"
#include "esvr/container.h"
#include "esvr/vdb_io.h"
#include "support/on_device.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using test::softBall;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class Options : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::uintmax_t sizeOf(const std::string& name) const {
    return std::filesystem::file_size(at(name));
  }
  test::TemporaryFolder folder_;
};

// ---- vdb2esvr

class Vdb2EsvrOption : public Options {
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
  const Json grid = convert({"--count", "5", "--iterations", "33"})["grids"][0];
  EXPECT_EQ(grid["curve"].back()["iteration"], 33);
}

TEST_F(Vdb2EsvrOption, ratioBoundsTheFile) {
  const std::uintmax_t bytes = sizeOf("in.vdb");
  for (const char* ratio : {"4", "8"}) {
    (void)quick({"--ratio", ratio});
    EXPECT_LE(double(sizeOf("out.esvr")), double(bytes) / std::stod(ratio)) << ratio;
  }
}

TEST_F(Vdb2EsvrOption, psnrIsReached) {
  const Json coarse = quick({"--psnr", "25"}), fine = quick({"--psnr", "40"});
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

TEST_F(Vdb2EsvrOption, fitForDrawingIsStoredInTheFile) {
  for (const FitFor fitFor : {FitFor::kVoxels, FitFor::kDrawing}) {
    const Json grid = quick({"--fit-for", fitFor == FitFor::kDrawing ? "drawing" : "voxels"});
    EXPECT_EQ(grid["representation"]["stored"], "ellipsoids");
    EXPECT_EQ(readEsvr(at("out.esvr")).grids[0].field.fitFor, fitFor);
  }
}

TEST_F(Vdb2EsvrOption, voxelSharesLowerTheErrorAtTheVoxels) {
  const auto psnrAt = [&](const std::string& share) {
    const Json grid = convert({"--count", "40", "--iterations", "100", "--fit-for", "drawing",
                               "--voxel-share", share})["grids"][0];
    return grid["metrics"]["psnr_box"].get<double>();
  };
  EXPECT_GT(psnrAt("1"), psnrAt("0"));
}

TEST_F(Vdb2EsvrOption, secondsEndTheFit) {
  const Json grid =
      convert({"--count", "20", "--iterations", "10000000", "--seconds", "0.2"})["grids"][0];
  EXPECT_EQ(grid["fit"]["end"], "time up");
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

TEST_F(Vdb2EsvrOption, kappaIsThatOfTheKernel) {
  const Json given = quick({"--count", "5", "--kappa", "3.5"}), free = quick({"--count", "5"});
  EXPECT_EQ(given["kernel"]["kappa"], 3.5);
  EXPECT_EQ(given["fit"]["kappa_learned"], false);
  EXPECT_EQ(free["fit"]["kappa_learned"], true);
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

TEST_F(Vdb2EsvrOption, storageLossBuysBytes) {
  const Json little = quick({"--count", "40", "--storage-loss", "0.02"});
  const Json much = quick({"--count", "40", "--storage-loss", "3"});
  EXPECT_LE(little["compact"]["loss_db"].get<double>(), 0.02 + 1e-3);
  EXPECT_LT(much["bytes"].get<int>(), little["bytes"].get<int>());
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

// ---- esvr2vdb

class Esvr2VdbOption : public Options {
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

// ---- esvr-compare

class CompareOption : public Options {
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

// ---- all programs

struct ProgramCommand {
  const char* name;
  const char* path;
  std::vector<std::string>
      arguments;  ///< arguments of a run of milliseconds; "DIR/x" is in the test's folder
};
std::ostream& operator<<(std::ostream& out, const ProgramCommand& program) {
  return out << program.name;
}

class EveryProgram : public Options, public testing::WithParamInterface<ProgramCommand> {
 protected:
  void SetUp() override {
    test::writeInput(at("in.vdb"), {{.voxels = softBall({})}});
    ASSERT_EQ(test::quickFit(at("in.vdb"), at("in.esvr")).exitCode, 0);
  }
  [[nodiscard]] test::ProgramRun run(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = GetParam().arguments;
    for (auto& argument : arguments)
      if (argument.starts_with("DIR/")) argument = at(argument.substr(4));
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto result = test::runProgram(GetParam().path, arguments);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return result;
  }
};

TEST_P(EveryProgram, helpAndVersionNeedNoFiles) {
  std::vector<std::string> job;
  if (std::string(GetParam().path) == ESVR_COMPARE) job = {GetParam().arguments[0]};
  for (const char* option : {"--help", "-h"}) {
    auto arguments = job;
    arguments.emplace_back(option);
    EXPECT_THAT(test::runProgram(GetParam().path, arguments).out,
                AllOf(HasSubstr("Usage:"), HasSubstr("--version")));
  }
  job.emplace_back("--version");
  EXPECT_THAT(test::runProgram(GetParam().path, job).out,
              AllOf(HasSubstr("0."), HasSubstr("OpenVDB")));
}

TEST_P(EveryProgram, saysNothingWhereQuietAndMoreWhereVerbose) {
  const auto quiet = run({"--quiet"}), usual = run({}), verbose = run({"--verbose"});
  EXPECT_THAT(quiet.out + quiet.err, IsEmpty());
  EXPECT_GE((verbose.out + verbose.err).size(), (usual.out + usual.err).size());
}

TEST_P(EveryProgram, takesANumberOfThreads) {
  (void)run({"--threads", "1"});
  auto arguments = GetParam().arguments;
  arguments.insert(arguments.end(), {"--threads", "0"});
  const auto none = test::runProgram(GetParam().path, arguments);
  EXPECT_EQ(none.exitCode, 2);
  EXPECT_THAT(none.err, HasSubstr("threads"));
}

INSTANTIATE_TEST_SUITE_P(
    All, EveryProgram,
    testing::Values(ProgramCommand{"vdb2esvr",
                                   VDB2ESVR,
                                   {"DIR/in.vdb", "DIR/o.esvr", "--force", "--count", "9",
                                    "--iterations", "30"}},
                    ProgramCommand{"esvr2vdb", ESVR2VDB, {"DIR/in.esvr", "DIR/o.vdb", "--force"}},
                    ProgramCommand{"render",
                                   ESVR_RENDER,
                                   {"DIR/in.esvr", "DIR/o.png", "--force", "--resolution", "16x16",
                                    "--device", "cpu"}},
                    ProgramCommand{"check", ESVR_COMPARE, {"check", "DIR/in.vdb", "DIR/in.esvr"}},
                    ProgramCommand{
                        "table",
                        ESVR_COMPARE,
                        {"table", "DIR/in.vdb", "DIR/in.esvr", "--rows", "none", "--runs", "1"}},
                    ProgramCommand{"curves",
                                   ESVR_COMPARE,
                                   {"curves", "DIR/in.vdb", "DIR/in.esvr", "--no-baselines", "-o",
                                    "DIR/c", "--force"}}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace esvr
