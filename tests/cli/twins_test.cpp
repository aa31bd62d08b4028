// Plan: vdb2esvr converts and stores grids with the same voxels once. Each comes back with its own
// name, transform and metadata. Grids that differ in a voxel or in whether they are a level set are
// converted apart. With a size, the bytes that twins do not take go to the other grids.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using test::InputGrid;
using test::InputMap;
using test::InputVoxel;
using test::quickFit;
using test::softBall;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

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

TEST_F(Twins, areNotGridsThatDifferInOneVoxelOrInTheirClass) {
  std::vector<InputVoxel> other = softBall({});
  other[100].value += 1e-6f;
  const std::vector<InputVoxel> band = test::distances(10);
  const Json grids = convert({{.name = "a", .voxels = softBall({})},
                              {.name = "b", .voxels = other},
                              {.name = "c", .voxels = band, .background = 20.0f},
                              {.name = "d", .voxels = band, .background = 20.0f, .levelSet = true}},
                             kQuick)["grids"];
  for (const Json& grid : grids) EXPECT_TRUE(grid["same_as"].is_null()) << grid["name"];
}

TEST_F(Twins, ofATwinAreNamedAfterTheFirst) {
  const InputGrid ball{.voxels = softBall({})};
  const Json grids = convert({ball, ball, ball}, kQuick)["grids"];
  EXPECT_EQ(grids[1]["same_as"], "density[0]");
  EXPECT_EQ(grids[2]["same_as"], "density[0]");
}

// ---- with a size

std::vector<std::string> sized(std::uint64_t bytes) {
  return {"--size", std::to_string(bytes), "--iterations", "60", "--representation", "ellipsoids"};
}

TEST_F(Twins, leaveTheirShareToTheOthers) {
  constexpr std::uint64_t kSize = 4000;
  const InputGrid red{.name = "red", .voxels = test::cloud(12)};
  InputGrid green = red, blue = red, last = red;
  green.name = "green", blue.name = "blue", last.name = "last";
  for (InputVoxel& voxel : last.voxels) voxel.value *= 3.0f;
  const auto ellipsoids = [](const Json& report) {
    std::uint64_t sum = 0;
    for (const Json& grid : report["grids"])
      if (grid["same_as"].is_null()) sum += grid["ellipsoids"].get<std::uint64_t>();
    return sum;
  };
  const auto alone = ellipsoids(convert({red, last}, sized(kSize)));
  const auto withTwins =
      ellipsoids(convert({red, green, blue, last}, sized(kSize + 2 * kBytesOfATwin)));
  EXPECT_GE(withTwins, alone);
  EXPECT_LE(outBytes(), kSize + 2 * kBytesOfATwin);
  EXPECT_GE(double(outBytes()), 0.97 * double(kSize + 2 * kBytesOfATwin));
}

/// Each ball is in a chunk of its own, and a twin has a row of the table for each of them. That is
/// more than is reserved for a twin before the number of chunks is known.
TEST_F(Twins, keepToTheSizeWhereTheyHaveManySections) {
  constexpr std::uint64_t kSize = 5000;
  InputGrid red{.name = "red"};
  for (int i = 0; i < 8; ++i)
    for (const InputVoxel& voxel : softBall({5000 * i, 0, 0})) red.voxels.push_back(voxel);
  InputGrid green = red;
  green.name = "green";
  const Json grids = convert({red, green}, sized(kSize))["grids"];
  EXPECT_EQ(grids[1]["same_as"], "red");
  EXPECT_GE(grids[1]["sections"].size(), 8u);
  EXPECT_LE(outBytes(), kSize);
  EXPECT_GE(double(outBytes()), 0.9 * double(kSize));
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
