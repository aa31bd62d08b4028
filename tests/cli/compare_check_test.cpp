// Plan: `esvr-compare check` is run as a separate process. Files of all three formats are compared
// with their source. The tests check each limit, baselines, --fail-on, and the exit codes and
// messages of refused input. `esvr-compare check` is run on files with grids that have no figures.
// A missing, an extra and a retyped grid fail, equal bytes pass, and --ignore-grids excludes a
// grid. Sequences with known errors are compared as a user does. The temporal PSNR must see errors
// that change from frame to frame, and no others, and each frame must be compared with its own.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/compare_fixture.h"
#include "cli/converters.h"
#include "cli/run_program.h"
#include "cli/vdb_inputs.h"
#include "esvr/vdb_io.h"
#include "vdb/foreign_grids.h"
#include "vdb/open_vdb.h"

#include <openvdb/io/File.h>

namespace esvr {
namespace {

using nlohmann::json;
using test::InputGrid;
using test::Refusal;
using test::softBall;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// A folder with a source file of two grids.
class CompareCheck : public test::FolderTest {
 protected:
  void SetUp() override { write("ref.vdb", {ball(), heat()}); }

  static InputGrid ball() { return {.voxels = softBall({})}; }
  static InputGrid heat() {
    return {.name = "heat", .voxels = softBall({40, 0, 0}, 2.0f, 1.0f), .background = 1.0f};
  }
  /// The ball with every voxel 0.01 too high.
  static InputGrid drifted() {
    InputGrid grid = ball();
    for (auto& voxel : grid.voxels) voxel.value += 0.01f;
    return grid;
  }
  void write(const std::string& name, const std::vector<InputGrid>& grids) const {
    test::writeInput(folder_ / name, grids);
  }
  [[nodiscard]] test::ProgramRun check(const std::string& candidate,
                                       std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {at("ref.vdb"), at(candidate)});
    return test::compare("check", more);
  }
  [[nodiscard]] json reportOf(const std::string& candidate,
                              std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--report", "-"});
    const auto run = check(candidate, more);
    return json::parse(run.out, nullptr, false);
  }
};

TEST_F(CompareCheck, refusesWhatTakesMoreMemoryThanAllowed) {
  write("drifted.vdb", {drifted()});
  EXPECT_EQ(check("drifted.vdb", {"-g", "density", "--max-memory", "100B"}).exitCode, 5);
}

TEST_F(CompareCheck, printsATableOfAHundredColumns) {
  InputGrid longer = heat();
  longer.name =
      "temperature_of_the_combustion_products_in_kelvin_after_the_second_pass_of_the_solver";
  write("ref.vdb", {ball(), longer});
  write("off.vdb", {drifted(), longer});
  const auto run = check("off.vdb", {"--ssim", "--max-relative-error", "50%"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  std::istringstream lines(run.out);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
  EXPECT_THAT(run.out, AllOf(HasSubstr('\n' + longer.name + '\n'), HasSubstr("\ndensity  ")));
}

TEST_F(CompareCheck, findsNoErrorInTheFileItself) {
  const auto report = reportOf("ref.vdb", {"--ssim"});
  ASSERT_EQ(report["grids"].size(), 2u);
  for (const auto& grid : report["grids"]) {
    EXPECT_TRUE(grid["psnr_box"].is_null()) << "infinite";
    EXPECT_TRUE(grid["psnr_t50"].is_null()) << "infinite";
    EXPECT_EQ(grid["max_error"], 0.0);
    EXPECT_EQ(grid["iou"], 1.0);
    EXPECT_EQ(grid["ssim"], 1.0);
    EXPECT_EQ(grid["mass_error"], 0.0);
    EXPECT_TRUE(grid["differences"].empty());
  }
  EXPECT_TRUE(report["file_differences"].empty());
}

TEST_F(CompareCheck, seesNoDifferenceWhereOnlyTheHeadersDiffer) {
  write("again.vdb", {ball(), heat()});  // has another UUID
  ASSERT_NE(test::readText(at("ref.vdb")), test::readText(at("again.vdb")));
  const auto run =
      check("again.vdb", {"--min-psnr", "200", "--max-error", "0", "--fail-on", "all"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("exact"));
}

TEST_F(CompareCheck, readsEsvrAndNanoVdbToo) {
  ASSERT_EQ(test::quickFit(at("ref.vdb"), at("fit.esvr")).exitCode, 0);
  ASSERT_EQ(test::esvr2vdb({at("fit.esvr"), at("back.nvdb")}).exitCode, 0);
  const auto esvr = reportOf("fit.esvr"), nano = reportOf("back.nvdb");
  for (const char* figure : {"psnr_box", "psnr_t10", "psnr_t50", "psnr_t90", "max_error", "iou"})
    EXPECT_EQ(esvr["grids"][0][figure], nano["grids"][0][figure]) << figure;
  EXPECT_TRUE(esvr["grids"][0]["differences"].empty());
  const auto reversed =
      test::compare("check", {at("back.nvdb"), at("fit.esvr"), "--min-psnr", "200"});
  EXPECT_EQ(reversed.exitCode, 0) << reversed.err << "the same voxels";
}

struct Limit {
  const char *option, *met, *missed;
};
class CompareLimit : public CompareCheck, public testing::WithParamInterface<Limit> {};

TEST_P(CompareLimit, passesOrFailsWithTheFigure) {
  write("off.vdb", {drifted(), heat()});
  const auto [option, met, missed] = GetParam();
  const std::string dashed = std::string("--") + option;
  EXPECT_EQ(check("off.vdb", {"-g", "density", dashed, met}).exitCode, 0);
  const auto run = check("off.vdb", {"-g", "density", dashed, missed, "-q"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, AllOf(HasSubstr("grid \"density\""), HasSubstr(dashed + " ")));
  EXPECT_THAT(run.out, IsEmpty());
}

// An error of 0.01 at every active voxel and a peak of 1 give 40 dB over the active voxels. The
// ball fills 485 of the 729 voxels of its box, which adds 1.8 dB. The sum of its values is about
// 0.43 times its number of voxels. The median column has a depth of 3.08, and the figures of the
// transmittance are those of the definition, summed up outside of this program.
INSTANTIATE_TEST_SUITE_P(
    All, CompareLimit,
    testing::Values(Limit{"min-psnr", "41.7", "41.9"}, Limit{"min-psnr-active", "39.9", "40.1"},
                    Limit{"min-psnr-t90", "53.9", "54"}, Limit{"min-psnr-t50", "42.6", "42.7"},
                    Limit{"min-psnr-t10", "39.4", "39.5"}, Limit{"max-error", "0.011", "0.009"},
                    Limit{"max-p999-error", "0.011", "0.009"}, Limit{"min-iou", "1", "1.01"},
                    Limit{"min-ssim", "0.9", "1.1"}, Limit{"max-mass-error", "0.03", "0.02"}),
    [](const auto& tested) {
      std::string name = tested.param.option;
      std::erase(name, '-');
      return name;
    });

TEST_F(CompareCheck, takesErrorsAsAShareOfTheRange) {
  write("off.vdb", {drifted(), heat()});  // the ball's values have a range of 0.96
  EXPECT_EQ(check("off.vdb", {"--max-error", "1.1%"}).exitCode, 0);
  EXPECT_EQ(check("off.vdb", {"--max-error", "0.9%"}).exitCode, 4);
}

// An error of 0.01 is 2 % of a half, and a larger share of the smallest values.
TEST_F(CompareCheck, boundsTheErrorRelativeToEachValue) {
  write("off.vdb", {drifted(), heat()});
  EXPECT_EQ(check("off.vdb", {"--max-relative-error", "2.1%,0.5"}).exitCode, 0);
  const auto run = check("off.vdb", {"--max-relative-error", "1.9%,0.5"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("relative error 0.02, --max-relative-error 0.019"));
  EXPECT_EQ(check("off.vdb", {"--max-relative-error", "2.1%"}).exitCode, 4);
  EXPECT_EQ(check("ref.vdb", {"--max-relative-error", "1e-9"}).exitCode, 0) << "the same bytes";
  EXPECT_EQ(check("off.vdb", {"--max-relative-error", "100%"}).exitCode, 2);
}

TEST_F(CompareCheck, boundsTheFilesBytes) {
  EXPECT_EQ(check("ref.vdb", {"--max-bytes", "1MB"}).exitCode, 0);
  const auto run = check("ref.vdb", {"--max-bytes", "100"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("--max-bytes 100"));
}

/// The level set of a ball, with all values inside active.
InputGrid surfaceOf(float radius) {
  InputGrid grid{.background = 3.0f, .levelSet = true};
  for (int x = -6; x <= 6; ++x)
    for (int y = -6; y <= 6; ++y)
      for (int z = -6; z <= 6; ++z) {
        const auto distance = float(std::hypot(x, y, z)) - radius;
        if (distance < grid.background) grid.voxels.push_back({{x, y, z}, distance});
      }
  return grid;
}

TEST_F(CompareCheck, boundsTheDistanceOfTheSurfacesOfLevelSets) {
  write("ref.vdb", {surfaceOf(2.5f)});
  write("moved.vdb", {surfaceOf(2.75f)});
  EXPECT_EQ(check("moved.vdb", {"--max-mesh-distance", "0.4"}).exitCode, 0);
  const auto run = check("moved.vdb", {"--max-mesh-distance", "0.15"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("--max-mesh-distance 0.15"));
  EXPECT_FALSE(reportOf("moved.vdb")["grids"][0].contains("mesh_distance"));
}

TEST_F(CompareCheck, failsWhereAGridIsMissing) {
  write("one.vdb", {ball()});
  const auto run = check("one.vdb");
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("\"heat\" is missing"));
  EXPECT_EQ(check("one.vdb", {"-g", "density"}).exitCode, 0);
}

TEST_F(CompareCheck, comparesGridsOfOtherNamesWhereTold) {
  InputGrid renamed = ball();
  renamed.name = "smoke";
  write("renamed.vdb", {renamed});
  const auto run = check("renamed.vdb", {"-g", "density=smoke"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.out, HasSubstr("name: \"density\", \"smoke\""));
  EXPECT_EQ(check("renamed.vdb", {"-g", "density=smoke", "--fail-on", "name"}).exitCode, 4);
}

TEST_F(CompareCheck, tellsDifferencesBesidesTheVoxels) {
  InputGrid other = ball();
  other.map = test::InputMap::kRotated;
  other.levelSet = true;
  other.background = 3.0f;
  write("other.vdb", {other, heat()});
  const auto run = check("other.vdb");
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("transform: "), HasSubstr("class: fog volume, level set"),
                             HasSubstr("background: 0, 3")));
  for (const char* kind : {"transform", "class", "background", "all", "name,transform"})
    EXPECT_EQ(check("other.vdb", {"--fail-on", kind}).exitCode, 4) << kind;
  EXPECT_EQ(check("other.vdb", {"--fail-on", "name,metadata"}).exitCode, 0);
}

TEST_F(CompareCheck, tellsMetadataThatDoNotComeBack) {
  ASSERT_EQ(test::quickFit(at("ref.vdb"), at("fit.esvr")).exitCode, 0);
  ASSERT_EQ(test::esvr2vdb({at("fit.esvr"), at("back.nvdb")}).exitCode, 0);
  const auto run = check("back.nvdb", {"--fail-on", "metadata"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, AllOf(HasSubstr("file metadata \"creator\": missing"),
                             HasSubstr("metadata \"note\": missing")));
  ASSERT_EQ(test::esvr2vdb({at("fit.esvr"), at("back.vdb")}).exitCode, 0);
  EXPECT_EQ(check("back.vdb", {"--fail-on", "all"}).exitCode, 0) << "our own mark is no difference";
}

TEST_F(CompareCheck, failsWhereTheVoxelsLieElsewhere) {
  write("moved.vdb", {{.voxels = softBall({100, 0, 0})}, heat()});
  const auto run = check("moved.vdb");
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("boxes that do not meet"));
}

TEST_F(CompareCheck, failsWhereTheCandidateIsEmpty) {
  write("empty.vdb", {{.voxels = {}}, heat()});
  const auto run = check("empty.vdb");
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("the candidate has no active voxel"));
}

TEST_F(CompareCheck, comparesZerosWithAPeakOfOne) {
  const std::vector<test::InputVoxel> zeros{{{0, 0, 0}, 0.0f}, {{1, 0, 0}, 0.0f}};
  write("ref.vdb", {ball(), {.name = "flame", .voxels = zeros}});
  EXPECT_EQ(check("ref.vdb", {"--max-error", "0"}).exitCode, 0);
  ASSERT_EQ(test::quickFit(at("ref.vdb"), at("fit.esvr")).exitCode, 0);
  EXPECT_EQ(check("fit.esvr", {"-g", "flame", "--max-error", "0"}).exitCode, 0);
  write("off.vdb", {ball(), {.name = "flame", .voxels = {{{0, 0, 0}, 0.1f}, {{1, 0, 0}, 0.1f}}}});
  const auto report = reportOf("off.vdb", {"-g", "flame"});
  EXPECT_NEAR(report["grids"][0]["psnr_active"].get<double>(), 20.0, 1e-5);
}

TEST_F(CompareCheck, comparesGridsThatAreNotFiniteByTheirBytes) {
  const auto odd = [](float value) {
    return InputGrid{.name = "odd", .voxels = {{{1, 2, 3}, value}, {{1 << 30, 0, 0}, 1.0f}}};
  };
  const float nan = std::nanf("");
  write("ref.vdb", {odd(nan), {.name = "far", .voxels = softBall({}), .background = nan}, ball()});
  const auto same = check("ref.vdb", {"--max-error", "0"});
  EXPECT_EQ(same.exitCode, 0) << same.err;
  ASSERT_EQ(test::vdb2esvr(
                {at("ref.vdb"), at("f.esvr"), "--keep", "odd", "--keep", "far", "-g", "density"})
                .exitCode,
            0);
  const auto carried = check("f.esvr", {"--min-psnr-active", "30"});
  EXPECT_EQ(carried.exitCode, 0) << carried.err;
  EXPECT_THAT(carried.out, AllOf(HasSubstr("grid \"odd\": the same bytes (float)"),
                                 HasSubstr("grid \"far\": the same bytes (float)")));

  write("other.vdb",
        {odd(2.0f), {.name = "far", .voxels = softBall({}), .background = nan}, ball()});
  const auto run = check("other.vdb");
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("grid \"odd\" cannot be compared: "));
  EXPECT_THAT(run.out, HasSubstr("density")) << "the others are compared";
  EXPECT_EQ(check("other.vdb", {"--max-bytes", "1"}).exitCode, 4);
}

TEST_F(CompareCheck, measuresOffsetValuesByTheirRange) {
  const auto pressure = [](float error) {
    InputGrid grid{.voxels = softBall({}, 40.0f, 101325.0f)};
    for (auto& voxel : grid.voxels) voxel.value += error;
    return grid;
  };
  write("ref.vdb", {pressure(0.0f)});
  write("off.vdb", {pressure(4.0f)});
  const auto report = reportOf("off.vdb");
  EXPECT_NEAR(report["grids"][0]["peak"].get<double>(), 40.0, 2.0);
  EXPECT_NEAR(report["grids"][0]["psnr_active"].get<double>(), 20.0, 0.5);
}

TEST_F(CompareCheck, holdsARunAgainstItsBaseline) {
  const std::vector<std::string> baseline{"--baseline", at("base.json")};
  write("off.vdb", {drifted(), heat()});
  EXPECT_EQ(check("off.vdb", {"--baseline", at("base.json"), "--update"}).exitCode, 0);
  EXPECT_EQ(check("off.vdb", baseline).exitCode, 0);

  InputGrid worse = drifted();
  worse.voxels.front().value += 0.1f;
  write("worse.vdb", {worse, heat()});
  const auto run = check("worse.vdb", baseline);
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("max error"), HasSubstr("baseline 0.01"), Not(HasSubstr("IoU"))));

  const auto better = check("ref.vdb", baseline);
  EXPECT_EQ(better.exitCode, 0) << better.err;
  EXPECT_THAT(better.out, HasSubstr("better"));
}

TEST_F(CompareCheck, keepsTheTolerancesOfABaseline) {
  write("off.vdb", {drifted(), heat()});
  ASSERT_EQ(check("off.vdb", {"--baseline", at("base.json"), "--update"}).exitCode, 0);
  auto stored = json::parse(test::readText(at("base.json")));
  stored["grids"]["density"]["max_error"]["tolerance"] = 5.0;
  test::writeText(at("base.json"), stored.dump());
  ASSERT_EQ(check("ref.vdb", {"--baseline", at("base.json"), "--update"}).exitCode, 0);
  const auto updated = json::parse(test::readText(at("base.json")));
  EXPECT_EQ(updated["grids"]["density"]["max_error"]["tolerance"], 5.0);
  EXPECT_EQ(updated["grids"]["density"]["max_error"]["value"], 0.0);
  EXPECT_TRUE(updated["grids"]["density"]["psnr_box"]["value"].is_null());
  EXPECT_EQ(check("off.vdb", {"--baseline", at("base.json")}).exitCode, 4) << "exact before";
}

TEST_F(CompareCheck, wantsEveryGridOfTheBaseline) {
  ASSERT_EQ(check("ref.vdb", {"--baseline", at("base.json"), "--update"}).exitCode, 0);
  const auto run = check("ref.vdb", {"--baseline", at("base.json"), "-g", "density"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("\"heat\" of the baseline was not compared"));
}

TEST_F(CompareCheck, leavesTheBaselineWhereALimitIsMissed) {
  write("off.vdb", {drifted(), heat()});
  const auto run =
      check("off.vdb", {"--baseline", at("base.json"), "--update", "--max-error", "0.001"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_FALSE(std::filesystem::exists(at("base.json")));
}

TEST_F(CompareCheck, reportsFailuresInJson) {
  write("off.vdb", {drifted(), heat()});
  const auto report = reportOf("off.vdb", {"--max-error", "0.001"});
  EXPECT_EQ(report["schema"], "esvr-check");
  ASSERT_EQ(report["failures"].size(), 1u);
  EXPECT_NEAR(report["grids"][0]["max_error"].get<double>(), 0.01, 1e-7);  // float32 near 1
}

class RefusedCheck : public CompareCheck, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedCheck, isExplainedAndLeavesNoFile) {
  write("zero.vdb", {{.voxels = {{{0, 0, 0}, 0.0f}, {{1, 0, 0}, 0.0f}}}});
  write("none.vdb", {{.voxels = {}}});
  write("else.vdb", {{.name = "fuel", .voxels = softBall({})}});
  test::writeText(at("broken.vdb"), "no such thing");
  test::writeText(at("notes.json"), "[1, 2]");
  GetParam().expectOf(test::compare("check", GetParam().argumentsIn(folder_)));
  EXPECT_THAT(folder_.names(), ElementsAre("broken.vdb", "else.vdb", "none.vdb", "notes.json",
                                           "ref.vdb", "zero.vdb"));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedCheck,
    testing::Values(
        Refusal{{}, 2, "REF"}, Refusal{{"DIR/ref.vdb"}, 2, "CAND"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "--max-error", "much"}, 2, "--max-error"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "--min-psnr", "inf"}, 2, "--min-psnr"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "--fail-on", "colour"}, 2, "colour"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "--update"}, 2, "--baseline"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "--peak", "0"}, 2, "--peak"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "--report", "DIR/x.txt"}, 2, ".json"},
        Refusal{{"DIR/missing.vdb", "DIR/ref.vdb"}, 3, "missing.vdb"},
        Refusal{{"DIR/ref.vdb", "DIR/missing.esvr"}, 3, "missing.esvr"},
        Refusal{{"DIR/ref.vdb", "DIR/broken.vdb"}, 3, "broken.vdb"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "-g", "smoke"}, 3, "\"density\""},
        Refusal{{"DIR/ref.vdb", "DIR/else.vdb"}, 3, "\"fuel\""},
        Refusal{{"DIR/none.vdb", "DIR/none.vdb", "--ignore-grids", "density"},
                3,
                "no grid can be compared"},
        Refusal{{"DIR/none.vdb", "DIR/ref.vdb", "-g", "density"}, 4, "the reference has none"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "--baseline", "DIR/no.json"}, 3, "no.json"},
        Refusal{{"DIR/ref.vdb", "DIR/ref.vdb", "--baseline", "DIR/notes.json"}, 3, "baseline"}));

TEST(CompareProgram, namesItsCommands) {
  const auto run = test::runProgram(ESVR_COMPARE, {"chekc", "a", "b"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("unknown command 'chekc'; the commands are check, table "
                                 "and curves; did you mean check?"));
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, {}).exitCode, 2);
  EXPECT_EQ(test::runProgram(ESVR_COMPARE, {"--help"}).exitCode, 0);
  EXPECT_THAT(test::runProgram(ESVR_COMPARE, {"check", "--help"}).out, HasSubstr("--min-psnr"));
}

TEST_F(CompareCheck, refusesABaselineThatChecksNothing) {
  ASSERT_EQ(check("ref.vdb", {"--baseline", at("base.json"), "--update"}).exitCode, 0);
  const auto good = json::parse(test::readText(at("base.json")));
  const auto expectRefused = [&](const json& baseline, const char* words) {
    test::writeText(at("bad.json"), baseline.dump());
    const auto run = check("ref.vdb", {"--baseline", at("bad.json")});
    EXPECT_EQ(run.exitCode, 3) << baseline;
    EXPECT_THAT(run.err, AllOf(HasSubstr("bad.json"), HasSubstr(words)));
  };
  for (const json& value : {json(5), json(), json(-1), json("density"), json::array()}) {
    auto bad = good;
    bad["grids"]["density"] = value;
    expectRefused(bad, "is no object with figures");
    bad = good;
    bad["grids"]["density"]["iou"] = value;
    expectRefused(bad, "is no object with a value and a tolerance");
    bad = good;
    bad["bytes"] = value;
    expectRefused(bad, "bytes is no object");
  }
  auto empty = good;
  empty["grids"]["density"] = json::object();
  expectRefused(empty, "has no figures");
  auto misspelt = good;
  misspelt["grids"]["density"]["max_eror"] = good["grids"]["density"]["max_error"];
  expectRefused(misspelt, "which is no figure");
  for (const json& tolerance : {json(), json(-1.0), json("1")}) {
    auto bad = good;
    bad["grids"]["density"]["max_error"]["tolerance"] = tolerance;
    expectRefused(bad, "tolerance");
  }
  EXPECT_EQ(check("ref.vdb", {"--baseline", at("base.json")}).exitCode, 0);
}

/// A folder with a source file of bool, int32, vec3s, points, density and empty grids.
class CompareCarried : public test::FolderTest {
 protected:
  void SetUp() override {
    test::writeMixedInput(at("ref.vdb"), {{.voxels = softBall({})}, {.name = "empty"}});
  }
  [[nodiscard]] test::ProgramRun check(const std::string& candidate,
                                       std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {at("ref.vdb"), at(candidate)});
    return test::compare("check", more);
  }
  void convert(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {at("ref.vdb"), at("f.esvr"), "--lossless", "--force"});
    const auto run = test::vdb2esvr(more);
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
};

const std::vector<std::string> kStrict{"--max-error", "0", "--fail-on", "all"};

TEST_F(CompareCarried, CarriedGridsAreEqualBitForBitInBothFormats) {
  convert();
  ASSERT_EQ(test::esvr2vdb({at("f.esvr"), at("back.vdb")}).exitCode, 0);
  for (const char* candidate : {"f.esvr", "back.vdb"}) {
    const auto run = check(candidate, kStrict);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_THAT(run.out, AllOf(HasSubstr("grid \"vec3s\": the same bytes (vec3s)"),
                               HasSubstr("grid \"empty\": the same bytes (float)")));
  }
}

TEST_F(CompareCarried, AGridWhoseVoxelsAreCarriedIsComparedByItsBytes) {
  convert({"--keep", "density"});
  const auto run = check("f.esvr", kStrict);
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("grid \"density\": the same bytes (float)"));
}

TEST_F(CompareCarried, AMissingGridFailsUnlessItIsIgnored) {
  convert({"--skip", "vec3s", "--skip", "empty"});
  const auto run = check("f.esvr");
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, AllOf(HasSubstr("\"vec3s\" is missing"), HasSubstr("\"empty\" is missing")));
  EXPECT_EQ(check("f.esvr", {"--ignore-grids", "vec3s"}).exitCode, 4);
  EXPECT_EQ(check("f.esvr", {"--ignore-grids", "vec3s", "--ignore-grids", "empty"}).exitCode, 0);
}

TEST_F(CompareCarried, AnExtraGridFailsUnlessItIsIgnored) {
  test::writeMixedInput(
      at("more.vdb"),
      {{.voxels = softBall({})}, {.name = "empty"}, {.name = "fuel", .voxels = softBall({})}});
  const auto run = check("more.vdb");
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("grid \"fuel\" is not in the reference"));
  EXPECT_EQ(check("more.vdb", {"--ignore-grids", "fuel"}).exitCode, 0);
}

TEST_F(CompareCarried, ARetypedGridFailsUnlessItIsIgnored) {
  const std::vector<InputGrid> grids{
      {.voxels = softBall({})}, {.name = "empty"}, {.name = "x", .voxels = softBall({})}};
  test::writeInput(at("floats.vdb"), {grids[2]});
  for (const char* type : {"vec3s", "double"}) {
    openvdb::io::File(at("other.vdb"))
        .write({test::emptyGrid(std::string("Tree_") + type + "_5_4_3", "x")});
    const auto run = test::compare("check", {at("floats.vdb"), at("other.vdb")});
    EXPECT_EQ(run.exitCode, 4);
    EXPECT_THAT(run.err, HasSubstr(std::string("of type ") + type + " in the candidate, float in"));
  }
  EXPECT_EQ(
      test::compare("check", {at("floats.vdb"), at("other.vdb"), "--ignore-grids", "x"}).exitCode,
      3)
      << "nothing is left to compare";
}

TEST_F(CompareCarried, OtherBytesFail) {
  const auto write = [&](const char* file, int number) {
    const auto grid = test::emptyGrid("Tree_int32_5_4_3", "x");
    grid->insertMeta("number", openvdb::Int32Metadata(number));
    openvdb::io::File(at(file)).write({grid});
  };
  write("a.vdb", 1);
  write("b.vdb", 2);
  write("c.vdb", 1);
  EXPECT_EQ(test::compare("check", {at("a.vdb"), at("c.vdb")}).exitCode, 0);
  const auto run = test::compare("check", {at("a.vdb"), at("b.vdb")});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("grid \"x\": its bytes differ"));
}

TEST_F(CompareCarried, AnEmptyGridOfOtherBytesHasNoVoxelsEither) {
  const auto write = [&](const char* file, std::vector<test::InputVoxel> voxels, float background) {
    test::writeInput(at(file),
                     {{.voxels = softBall({})},
                      {.name = "e", .voxels = std::move(voxels), .background = background}});
  };
  write("a.vdb", {}, 0.0f);
  write("b.vdb", {}, 2.0f);
  write("c.vdb", softBall({}), 0.0f);
  const auto empty = test::compare("check", {at("a.vdb"), at("b.vdb")});
  EXPECT_EQ(empty.exitCode, 0) << empty.err;
  EXPECT_THAT(empty.out, AllOf(HasSubstr("grid \"e\": no active voxel in either file"),
                               HasSubstr("grid \"e\": background: 0, 2")));
  EXPECT_EQ(test::compare("check", {at("a.vdb"), at("b.vdb"), "--fail-on", "all"}).exitCode, 4);
  const auto full = test::compare("check", {at("a.vdb"), at("c.vdb")});
  EXPECT_EQ(full.exitCode, 4);
  EXPECT_THAT(full.err, HasSubstr("active voxels, the reference has none"));
}

TEST_F(CompareCarried, TablesTakeTheGridThatIsNotCarried) {
  convert();
  const auto run = test::compare("table", {at("ref.vdb"), at("f.esvr"), "--rows", "none"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("f.esvr"));
  convert({"--keep", "density"});
  const auto carried = test::compare("table", {at("ref.vdb"), at("f.esvr"), "--rows", "none"});
  EXPECT_THAT(carried.out + carried.err, HasSubstr("is carried unchanged"));
}

using Json = nlohmann::json;
using Words = std::vector<std::string>;

/// Three frames of balls with the peaks 2, 3 and 4 as a.1.vdb, ...; b.#.vdb are brighter by a part.
class SequenceCheck : public test::FolderTest {
 protected:
  void SetUp() override { writeFrames("a", {0.0f, 0.0f, 0.0f}); }
  void writeFrames(const std::string& name, const std::vector<float>& brighter) const {
    for (std::size_t i = 0; i < brighter.size(); ++i) {
      auto voxels = test::softBall({}, float(i + 2));
      for (auto& voxel : voxels) voxel.value += brighter[i];
      test::writeInput(at(name + "." + std::to_string(i + 1) + ".vdb"), {{.voxels = voxels}});
    }
  }
  [[nodiscard]] test::ProgramRun check(const std::string& candidate, Words more = {}) const {
    more.insert(more.begin(), {"check", at("a.@.vdb"), at(candidate)});
    return test::runProgram(ESVR_COMPARE, more);
  }
  void store(const std::string& frames) const {
    const auto run = test::vdb2esvr(
        {at("a.@.vdb"), at("a.esvr"), "--lossless", "--device", "cpu", "--frames", frames});
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
};

TEST_F(SequenceCheck, findsNoErrorInAFileThatHasEveryBit) {
  store("1-3");
  const auto run = check("a.esvr", {"--min-psnr-temporal", "300", "--report", at("r.json")});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("temporal"), HasSubstr("frame 3: density")));
  const Json report = Json::parse(test::readText(at("r.json")));
  ASSERT_EQ(report["grids"].size(), 3u);
  EXPECT_FALSE(report["grids"][0].contains("psnr_temporal")) << "there is no frame before it";
  EXPECT_TRUE(report["grids"][2]["psnr_temporal"].is_null()) << "infinite";
  EXPECT_EQ(report["grids"][2]["frame"], 3);
  EXPECT_EQ(report["bytes"], sizeOf("a.esvr"));
}

TEST_F(SequenceCheck, doesNotCountErrorsThatAllFramesShare) {
  writeFrames("b", {0.25f, 0.25f, 0.25f});
  EXPECT_EQ(check("b.@.vdb", {"--min-psnr-temporal", "100"}).exitCode, 0);
  EXPECT_EQ(check("b.@.vdb", {"--min-psnr", "100"}).exitCode, 4);
}

TEST_F(SequenceCheck, countsErrorsThatChange) {
  writeFrames("b", {0.25f, 0.25f, 0.5f});
  const auto run = check("b.@.vdb", {"--min-psnr-temporal", "100"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("frame 3: grid \"density\": temporal"));
  EXPECT_THAT(run.err, testing::Not(HasSubstr("frame 2: grid")));
}

TEST_F(SequenceCheck, namesFramesThatOnlyOneSequenceHas) {
  store("1-2");
  const auto run = check("a.esvr");
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("1 of 3 frames are not in " + at("a.esvr") + ": 3"));
  EXPECT_EQ(check("a.esvr", {"--frames", "1-2"}).exitCode, 0);
}

TEST_F(SequenceCheck, refusesASingleFileBesideASequence) {
  EXPECT_EQ(check("a.1.vdb").exitCode, 2);
  const auto run = test::runProgram(
      ESVR_COMPARE, {"check", at("a.1.vdb"), at("a.1.vdb"), "--min-psnr-temporal", "40"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("--min-psnr-temporal need sequences"));
}

}  // namespace
}  // namespace esvr
