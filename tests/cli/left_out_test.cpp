// Plan: for each of the three decisions in a report's `left_out`, one run uses the part and one does
// not. The figures are those of the file and of the candidates. A decision that a run did not have
// to make has no figures.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using Voxels = std::vector<test::InputVoxel>;

struct Input {
  float background = 0.0f;  ///< above 0 for a level set
  const char* iterations = "60";
};

class LeftOut : public testing::Test {
 protected:
  /// The first grid of the report of a conversion.
  Json gridOf(const Voxels& voxels, std::vector<std::string> options, const Input& input = {}) {
    test::writeInput(
        in_,
        {{.voxels = voxels, .background = input.background, .levelSet = input.background > 0.0f}});
    options.insert(options.begin(), {in_, folder_ / "out.esvr", "--device", "cpu", "--force"});
    options.insert(options.end(), {"--iterations", input.iterations, "--report", "-"});
    const auto run = test::vdb2esvr(options);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return Json::parse(run.out)["grids"][0];
  }

  /// The entry of a part, of which there must be exactly one.
  static Json entryOf(const Json& grid, const std::string& part) {
    Json found;
    int entries = 0;
    for (const auto& entry : grid["left_out"])
      if (entry["part"] == part) found = entry, ++entries;
    EXPECT_EQ(entries, 1) << part;
    return found;
  }

  static void expectNoFigures(const Json& entry) {
    for (const char* key : {"bytes_with", "bytes_without", "seconds"})
      EXPECT_FALSE(entry.contains(key)) << entry;
  }

  static Voxels noise() {
    test::Random random(17);
    Voxels voxels = test::softBall({});
    for (auto& voxel : voxels) voxel.value = float(random(0.1, 1.0));
    return voxels;
  }

  /// Noise of which half the voxels have one value.
  static Voxels noiseWithPlateau() {
    Voxels voxels = noise();
    for (auto& voxel : voxels)
      if (voxel.at.x < 0) voxel.value = 0.731f;
    return voxels;
  }

  /// The narrow band of a sphere.
  static Voxels band() {
    Voxels voxels = test::distances(12);
    std::erase_if(voxels, [](const auto& voxel) { return std::abs(voxel.value) >= kBandWidth; });
    return voxels;
  }

  static constexpr float kBandWidth = 3.0f;  ///< voxels
  test::TemporaryFolder folder_;
  std::string in_ = folder_ / "in.vdb";
};

TEST_F(LeftOut, saysWhetherTheSumIsClamped) {
  const std::vector<std::string> ellipsoids{"--count", "30", "--representation", "ellipsoids"};
  const Json clamp = entryOf(gridOf(test::softBall({}), ellipsoids), "clamp");
  EXPECT_TRUE(clamp["used"]);
  expectNoFigures(clamp);
  EXPECT_FALSE(entryOf(gridOf(noise(), {"--lossless"}), "clamp")["used"]);
  EXPECT_FALSE(entryOf(gridOf(band(), ellipsoids, {.background = kBandWidth}), "clamp")["used"]);
}

TEST_F(LeftOut, namesLayersAndTheGpuOnlyForEllipsoids) {
  const Json ellipsoids =
      gridOf(test::softBall({}), {"--count", "9", "--representation", "ellipsoids"});
  EXPECT_FALSE(entryOf(ellipsoids, "importance layers")["used"]);
  EXPECT_FALSE(entryOf(ellipsoids, "GPU")["used"]);
  for (const auto& entry : gridOf(noise(), {"--lossless"})["left_out"]) {
    EXPECT_NE(entry["part"], "importance layers");
    EXPECT_NE(entry["part"], "GPU");
  }
}

TEST_F(LeftOut, hasTheSecondsOfTheShortFitsThatAClampMakesPossible) {
  Voxels flat = test::softBall({});
  for (auto& voxel : flat) voxel.value = std::min(voxel.value, 0.5f);
  const Json grid = gridOf(flat, {"--size", "2000", "--representation", "ellipsoids"});
  const Json clamp = entryOf(grid, "clamp");
  EXPECT_TRUE(clamp["used"]);
  ASSERT_TRUE(clamp.contains("seconds"));
  EXPECT_GT(clamp["seconds"].get<double>(), 0.0);
}

TEST_F(LeftOut, saysWhetherTheLatticeContainsThePlateau) {
  const Json grid = gridOf(noiseWithPlateau(), {"--psnr", "30"});
  const Json plateau = entryOf(grid, "plateau");
  EXPECT_TRUE(plateau["used"]);
  EXPECT_EQ(plateau["bytes_with"], grid["representation"]["voxels"]["bytes"]);
  EXPECT_LT(plateau["bytes_with"].get<int>(), plateau["bytes_without"].get<int>());
  EXPECT_GT(plateau["seconds"].get<double>(), 0.0);
}

TEST_F(LeftOut, saysWhyThereIsNoPlateau) {
  const Json searched = entryOf(gridOf(noise(), {"--psnr", "30"}), "plateau");
  EXPECT_FALSE(searched["used"]);
  EXPECT_TRUE(searched.contains("seconds")) << "the most frequent value was searched for";
  EXPECT_FALSE(searched.contains("bytes_with"));
  const Json exact = entryOf(gridOf(noise(), {"--lossless"}), "plateau");
  EXPECT_FALSE(exact["used"]);
  expectNoFigures(exact);
}

TEST_F(LeftOut, hasNoBytesThatWereOnlyEstimated) {
  const Json grid = gridOf(noise(), {"--psnr", "40"});
  ASSERT_TRUE(grid["representation"]["ellipsoids"]["estimated"]);
  const Json choice = entryOf(grid, "representation");
  EXPECT_EQ(choice["bytes_with"], grid["representation"]["voxels"]["bytes"]);
  EXPECT_FALSE(choice.contains("bytes_without"));
  EXPECT_GT(choice["seconds"].get<double>(), 0.0) << "the short fit took time";
}

TEST_F(LeftOut, hasNoFiguresOfARepresentationThatIsGiven) {
  const Json choice = entryOf(gridOf(noise(), {"--lossless"}), "representation");
  EXPECT_FALSE(choice["used"]);
  expectNoFigures(choice);
}

}  // namespace
}  // namespace esvr
