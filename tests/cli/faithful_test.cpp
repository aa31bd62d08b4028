// Plan: what a grid holds besides finite active voxels of floats is kept, or the program says that it
// is not and how to keep it: values of inactive voxels, halfs, giant tiles, and all that a conversion
// refuses. Every promise is checked on the .vdb file that a user gets in the end.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "esvr/voxel_layer.h"
#include "vdb/carried_bytes.h"

namespace esvr {
namespace {

using test::InputGrid;
using test::softBall;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Faithful : public testing::Test {
 protected:
  [[nodiscard]] std::string in() const { return folder_ / "in.vdb"; }
  [[nodiscard]] std::string out() const { return folder_ / "out.esvr"; }
  [[nodiscard]] std::string back() const { return folder_ / "back.vdb"; }

  [[nodiscard]] test::ProgramRun convert(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {in(), out(), "--force"});
    return test::vdb2esvr(more);
  }
  /// Converts the input there and back. \return the run of vdb2esvr
  test::ProgramRun throughTheFile(const std::vector<std::string>& options) const {
    auto run = convert(options);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    const auto decode = test::esvr2vdb({out(), back(), "--force"});
    EXPECT_EQ(decode.exitCode, 0) << decode.err;
    return run;
  }
  [[nodiscard]] test::ProgramRun check(const std::string& candidate,
                                       std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"check", in(), candidate});
    return test::runProgram(ESVR_COMPARE, more);
  }
  void expectSameBytes(const std::string& grid) const {
    const std::size_t place = 0;
    ASSERT_EQ(inspectVdb(back()).grids.at(0).name, grid);
    EXPECT_EQ(test::withoutVersion(readCarried(back(), {&place, 1})),
              test::withoutVersion(readCarried(in(), {&place, 1})));
  }

  test::TemporaryFolder folder_;
};

class Inactive : public Faithful {
 protected:
  void SetUp() override {
    test::writeInput(
        in(), {{.voxels = softBall({}), .inactive = {{{20, 0, 0}, 5.0f}, {{0, 0, 100}, 5.5f}}}});
  }
};

TEST_F(Inactive, AreKeptByLossless) {
  const auto run = throughTheFile({"--lossless"});
  EXPECT_THAT(run.out, HasSubstr("carried unchanged, because it has 2 inactive values (5 to 5.5"));
  for (const auto& file : {out(), back()}) {
    const auto checked = check(file, {"--fail-on", "all", "--max-error", "0"});
    EXPECT_EQ(checked.exitCode, 0) << checked.err;
  }
  EXPECT_EQ(readGrid(back(), "density").inactive, readGrid(in(), "density").inactive);
}

TEST_F(Inactive, AreCountedWhereTheyAreGivenUp) {
  const auto run = throughTheFile(
      {"--representation", "voxels", "--psnr", "40", "--report", folder_ / "r.json"});
  EXPECT_THAT(run.out, HasSubstr("density: gives up 2 inactive values (5 to 5.5, first at"));
  EXPECT_THAT(run.out, HasSubstr("--lossless or --keep density keeps them"));
  const auto checked = check(out());
  EXPECT_EQ(checked.exitCode, 0) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr("inactive values that are not the background: 2 inactive "
                                     "values (5 to 5.5"));
  EXPECT_EQ(check(back(), {"--fail-on", "inactive"}).exitCode, 4);
}

TEST_F(Inactive, OfVectorsAreKeptByLossless) {
  const auto plain = [&] {
    test::writeVectorInput(in(), {.voxels = softBall({})});
    return throughTheFile({"--lossless"});
  };
  EXPECT_THAT(plain().out, Not(HasSubstr("inactive")));
  test::writeVectorInput(in(), {.voxels = softBall({}), .inactive = {{{20, 0, 0}, 2.0f}}});
  EXPECT_THAT(throughTheFile({"--lossless"}).out,
              HasSubstr("velocity: carried unchanged, because it has"));
  expectSameBytes("velocity");
}

TEST_F(Inactive, SignsOfALevelSetAreNoReasonToCarryIt) {
  test::writeInput(in(), {{.voxels = test::distances(9), .background = 3.0f, .levelSet = true}});
  EXPECT_THAT(throughTheFile({"--lossless"}).out, Not(HasSubstr("inactive")));
}

TEST_F(Inactive, AreNotSharedByGridsWithTheSameVoxels) {
  const InputGrid density{.voxels = softBall({})};
  InputGrid other = density;
  other.name = "other";
  other.inactive = {{{20, 0, 0}, 5.0f}};
  test::writeInput(in(), {density, other});
  throughTheFile({"--lossless"});
  EXPECT_EQ(readGrid(back(), "density").inactive.count(), 0u);
  EXPECT_EQ(readGrid(back(), "other").inactive.count(), 1u);
}

/// Halfs in a cube of 24^3 voxels, from 0 to the largest value.
std::vector<test::InputVoxel> noise(float largest) {
  std::vector<test::InputVoxel> voxels;
  std::uint32_t state = 1;
  for (int x = 0; x < 24; ++x)
    for (int y = 0; y < 24; ++y)
      for (int z = 0; z < 24; ++z) {
        state = state * 1664525u + 1013904223u;
        const bool inMiddle = x / 6 == 1 && y / 6 == 1 && z / 6 == 1;
        voxels.push_back({{x, y, z}, inMiddle ? largest : largest * float(state >> 8) * 0x1p-24f});
      }
  return voxels;
}

class Halfs : public Faithful {};

TEST_F(Halfs, KeepTheBoundInTheFileThatUsersOpen) {
  test::writeInput(in(), {{.voxels = noise(1.0f), .half = true}});
  const VolumeGrid source = readGrid(in(), "density");
  for (const char* bound : {"0.0001", "0.0003", "0.0004", "0.0007", "0.02"})
    for (const char* topology : {"auto", "exact"}) {
      throughTheFile({"--max-error", bound, "--topology", topology});
      EXPECT_TRUE(inspectVdb(back()).grids.at(0).savedAsHalf);
      EXPECT_LE(largestDifference(source.volume, readGrid(back(), "density").volume),
                std::stod(bound));
    }
}

TEST_F(Halfs, DoNotBecomeLargerThanTheLargest) {
  test::writeInput(in(), {{.voxels = noise(65504.0f), .half = true}});
  const std::vector<std::vector<std::string>> goals{
      {"--representation", "voxels", "--psnr", "20"},
      {"--max-error", "3%"},
      {"--lossless"},
      {"--count", "20", "--iterations", "20", "--representation", "ellipsoids"}};
  for (const auto& goal : goals) {
    throughTheFile(goal);
    EXPECT_TRUE(inspectVdb(back()).grids.at(0).savedAsHalf);
    const ValueRange range = activeRange(readGrid(back(), "density").volume);
    EXPECT_LE(range.max, 65504.0f);
  }
}

struct Refused {
  const char* name;
  InputGrid grid;
  const char* reason;
};
std::ostream& operator<<(std::ostream& out, const Refused& refused) { return out << refused.name; }

class WayOut : public Faithful, public testing::WithParamInterface<Refused> {};

TEST_P(WayOut, IsToldAndCarriesTheGrid) {
  test::writeInput(in(), {GetParam().grid});
  for (const auto& goal :
       {std::vector<std::string>{}, {"--lossless"}, {"--max-error", "1%"}, {"--size", "9KB"}}) {
    const auto run = convert(goal);
    EXPECT_EQ(run.exitCode, 3);
    EXPECT_THAT(run.err,
                AllOf(HasSubstr(GetParam().reason), HasSubstr("--keep 'my grid' carries")));
  }
  throughTheFile({"--keep", "my grid"});
  expectSameBytes("my grid");
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr std::int32_t kFar = 1'500'000'000;

INSTANTIATE_TEST_SUITE_P(
    All, WayOut,
    testing::Values(
        Refused{
            "nan", {.name = "my grid", .voxels = {{{0, 0, 0}, kNan}, {{1, 0, 0}, 1.0f}}}, "NaN"},
        Refused{"background",
                {.name = "my grid", .voxels = softBall({}), .background = kNan},
                "background"},
        Refused{"infiniteBackground",
                {.name = "my grid",
                 .voxels = softBall({}),
                 .background = std::numeric_limits<float>::infinity()},
                "background"},
        Refused{"far",
                {.name = "my grid", .voxels = {{{-kFar, 0, 0}, 1.0f}, {{kFar, 0, 0}, 1.0f}}},
                "2^31"}),
    [](const auto& refused) { return std::string(refused.param.name); });

}  // namespace
}  // namespace esvr
