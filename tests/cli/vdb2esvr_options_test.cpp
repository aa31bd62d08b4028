// Plan: these tests cover the options of vdb2esvr whose effect no other test shows. Each test
// compares the output with and without an option.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "support/on_device.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

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

TEST_F(Vdb2EsvrOption, ratioBoundsTheFile) {
  const std::uintmax_t bytes = sizeOf("in.vdb");
  for (const char* ratio : {"4", "8"}) {
    (void)quick({"--ratio", ratio});
    EXPECT_LE(double(sizeOf("out.esvr")), double(bytes) / std::stod(ratio)) << ratio;
  }
}

TEST_F(Vdb2EsvrOption, psnrIsReached) {
  // By value, because the bytes of a mask are larger for coarser sums.
  const auto reaching = [&](const char* psnr) {
    return quick({"--psnr", psnr, "--topology", "threshold"});
  };
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

}  // namespace
}  // namespace esvr
