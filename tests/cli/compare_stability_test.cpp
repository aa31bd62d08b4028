// Plan: `esvr-compare stability` is run as a separate process on fitted files, on a file of needles
// that was made for it, on sequences, and on grids that have no ellipsoids. The tests check the
// figures of the report, the verdict and its exit code, each option, and refused input.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/compare_fixture.h"
#include "esvr/container.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using Words = std::vector<std::string>;

class CompareStability : public test::FittedBall {
 protected:
  [[nodiscard]] static test::ProgramRun stability(const std::string& file, Words more = {}) {
    more.insert(more.begin(), file);
    return test::compare("stability", more);
  }
  [[nodiscard]] static json reportOf(const std::string& file, Words more = {}) {
    more.insert(more.end(), {"--device", "cpu", "--report", "-"});
    const auto run = stability(file, more);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return json::parse(run.out, nullptr, false);
  }
  /// A file with ellipsoids of an aspect ratio of up to 1000.
  void writeNeedles(const std::string& name) const {
    StoredGrid grid;
    grid.descriptor.name = "needles";
    grid.field = test::randomField({.smallest = 0.1, .aspect = 1000.0});
    grid.activeBox = {{0, 0, 0}, {39, 39, 39}};
    grid.valueMin = -1.0f, grid.valueMax = 1.0f;
    grid.withinRange = false;
    EsvrFile file;
    file.grids.push_back(std::move(grid));
    writeEsvr(at(name), file);
  }
};

TEST_F(CompareStability, passesAFitAndSaysWhatItMeasured) {
  const json report = reportOf(at("fit.esvr"));
  ASSERT_EQ(report["grids"].size(), 1u);
  const json& grid = report["grids"][0];
  EXPECT_EQ(grid["name"], "density");
  EXPECT_GT(grid["ellipsoids"], 0);
  ASSERT_EQ(grid["devices"].size(), 1u);
  const json& cpu = grid["devices"][0];
  EXPECT_EQ(cpu["device"], "CPU");
  EXPECT_EQ(cpu["verdict"], "pass");
  // A sum of at most 30 ellipsoids of ordinary shapes has an error of some 2^-24 of the peak.
  EXPECT_GE(cpu["correct_digits"], 5);
  EXPECT_GT(cpu["max_difference"], 0.0);
  EXPECT_LT(cpu["share_of_bound"], 1.0);
  EXPECT_FALSE(cpu["worst"].empty());
  EXPECT_TRUE(grid["between_devices"].is_null());
  EXPECT_EQ(grid["difficulties"]["kappa"][0], 0.0) << "that of the fit";
  EXPECT_GE(grid["difficulties"]["overlap"]["max"], 1);
  EXPECT_TRUE(report["failures"].empty());
  const auto run = stability(at("fit.esvr"));
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("PASS"), HasSubstr("at voxel (")));
}

TEST_F(CompareStability, failsBeyondTheLimitAndNamesTheFirstDigitThatIsLost) {
  writeNeedles("needles.esvr");
  const auto passes = stability(at("needles.esvr"), {"--max-difference", "1e-3"});
  EXPECT_EQ(passes.exitCode, 0) << passes.err;
  const auto run = stability(at("needles.esvr"), {"--max-difference", "1e-9"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("grid \"needles\", CPU: FAIL, digit"), HasSubstr("is lost")));
  EXPECT_THAT(run.out, HasSubstr("FAIL")) << "the figures are printed too";
  const json report = reportOf(at("needles.esvr"), {"--max-difference", "1e-3"});
  EXPECT_GT(report["grids"][0]["difficulties"]["aspect"], 300.0);
  EXPECT_GT(report["grids"][0]["difficulties"]["condition"], 9e4);
  EXPECT_LT(report["grids"][0]["difficulties"]["scale"][0], 0.2);
}

TEST_F(CompareStability, comparesAsManyBricksAsAsked) {
  const auto sampled = [&](const char* bricks) {
    return reportOf(at("fit.esvr"),
                    {"--bricks", bricks})["grids"][0]["difficulties"]["bricks_sampled"]
        .get<int>();
  };
  EXPECT_GT(sampled("10000"), sampled("1"));
  EXPECT_LE(sampled("1"), 5) << "one, and those of four extreme ellipsoids";
}

TEST_F(CompareStability, listsGridsThatHaveNoEllipsoids) {
  test::writeMixedInput(at("mixed.vdb"), {{.voxels = test::softBall({})}});
  ASSERT_EQ(test::vdb2esvr({at("mixed.vdb"), at("mixed.esvr"), "--lossless"}).exitCode, 0);
  const auto run = stability(at("mixed.esvr"));
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("grid \"density\": nothing to measure, it is stored as voxels"),
                    HasSubstr("it is carried unchanged")));
  const json one = reportOf(at("mixed.esvr"), {"--grid", "density"});
  ASSERT_EQ(one["grids"].size(), 1u);
  EXPECT_TRUE(one["grids"][0]["difficulties"].is_null());
}

TEST_F(CompareStability, measuresTheComponentsOfVectors) {
  test::writeVectorInput(at("wind.vdb"), {.voxels = test::softBall({})});
  ASSERT_EQ(test::quickFit(at("wind.vdb"), at("wind.esvr")).exitCode, 0);
  const json report = reportOf(at("wind.esvr"));
  ASSERT_EQ(report["grids"].size(), 3u);
  EXPECT_TRUE(report["grids"][1]["name"].get<std::string>().ends_with(".y"));
}

TEST_F(CompareStability, measuresTheFramesOfASequence) {
  for (const char* frame : {"1", "2"})
    test::writeInput(at("s." + std::string(frame) + ".vdb"), {{.voxels = test::softBall({})}});
  ASSERT_EQ(test::quickFit(at("s.@.vdb"), at("all.esvr")).exitCode, 0);
  ASSERT_EQ(test::quickFit(at("s.@.vdb"), at("s.@.esvr")).exitCode, 0);
  for (const char* file : {"all.esvr", "s.@.esvr"}) {
    EXPECT_EQ(reportOf(at(file))["grids"].size(), 2u);
    const json report = reportOf(at(file), {"--frames", "2"});
    ASSERT_EQ(report["grids"].size(), 1u);
    EXPECT_EQ(report["grids"][0]["frame"], 2);
    EXPECT_EQ(report["grids"][0]["name"], "frame 2: density");
  }
  EXPECT_EQ(stability(at("all.esvr"), {"--frames", "7"}).exitCode, 3);
  EXPECT_EQ(stability(at("fit.esvr"), {"--frames", "1"}).exitCode, 2);
}

TEST_F(CompareStability, replacesAReportWhereForced) {
  test::writeText(at("r.json"), "old");
  const Words report{"--report", at("r.json")};
  EXPECT_EQ(stability(at("fit.esvr"), report).exitCode, 1);
  EXPECT_EQ(test::readText(at("r.json")), "old");
  Words forced = report;
  forced.emplace_back("--force");
  EXPECT_EQ(stability(at("fit.esvr"), forced).exitCode, 0);
  EXPECT_THAT(test::readText(at("r.json")), HasSubstr("esvr-stability"));
}

TEST_F(CompareStability, refusesWhatHasNoEllipsoidsAndWhatIsTooLarge) {
  const auto vdb = stability(at("ref.vdb"));
  EXPECT_EQ(vdb.exitCode, 3);
  EXPECT_THAT(vdb.err, HasSubstr("not an .esvr file"));
  EXPECT_EQ(stability(at("fit.esvr"), {"--grid", "heat"}).exitCode, 3);
  EXPECT_EQ(stability(at("fit.esvr"), {"--max-memory", "100B"}).exitCode, 5);
  EXPECT_EQ(stability(at("fit.esvr"), {"--scratch", at("no such folder")}).exitCode, 2);
  EXPECT_EQ(stability(at("fit.esvr"), {"--max-difference", "2"}).exitCode, 2);
}

class CompareStabilityOnGpu : public CompareStability {};

TEST_F(CompareStabilityOnGpu, measuresBothDevices) {
  const auto run = stability(at("fit.esvr"), {"--device", "cuda", "--report", "-"});
  if (run.exitCode == 5) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const json grid = json::parse(run.out)["grids"][0];
  ASSERT_EQ(grid["devices"].size(), 2u);
  EXPECT_THAT(grid["devices"][1]["device"].get<std::string>(), HasSubstr("cuda"));
  EXPECT_GE(grid["devices"][1]["correct_digits"], 5);
  EXPECT_GT(grid["between_devices"], 0.0);
}

}  // namespace
}  // namespace esvr
