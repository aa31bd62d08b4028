// Plan: `esvr-compare check` compares files of all formats, and sequences, with sources whose errors are
// known. The temporal PSNR must see errors that change from frame to frame, and no others.

#include <array>
#include <cmath>

#include "cli/conversion.h"
#include "vdb/open_vdb.h"

#include <openvdb/io/File.h>

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// A folder with a source file of two grids.
class CompareCheck : public FolderTest {
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
    writeInput(folder_ / name, grids);
  }
  [[nodiscard]] ProgramRun check(const std::string& candidate, const Words& more = {}) const {
    return compare("check", joined({at("ref.vdb"), at(candidate)}, more));
  }
  [[nodiscard]] Json reportOf(const std::string& candidate, const Words& more = {}) const {
    const auto run = check(candidate, joined(more, "--report -"));
    return Json::parse(run.out, nullptr, false);
  }
};

TEST_F(CompareCheck, refusesWhatTakesMoreMemoryThanAllowed) {
  write("drifted.vdb", {drifted()});
  EXPECT_THAT(check("drifted.vdb", "-g density --max-memory 100B"), Fails(5));
}

TEST_F(CompareCheck, limitsVectorsAsTheGoalsOfAConversionDo) {
  const std::array<float, 3> same{1.0f, 1.0f, 1.0f};
  const float amplitude = 1.0f / std::sqrt(3.0f), error = 0.01f * amplitude;
  const std::vector<InputVoxel> voxels{{{0, 0, 0}, amplitude}, {{1, 0, 0}, -amplitude}};
  std::vector<InputVoxel> shifted = voxels;  // lengths change by 0.01, the longest of which is 1
  for (InputVoxel& voxel : shifted) voxel.value += error;
  writeVectorInput(at("ref.vdb"), {.voxels = voxels, .scale = same});
  writeVectorInput(at("shifted.vdb"), {.voxels = shifted, .scale = same});
  // 40 dB of the lengths, and 44.77 dB of each component
  succeeded(check("shifted.vdb", "--min-psnr 44.7 --min-psnr-active 44.7"));
  EXPECT_THAT(check("shifted.vdb", "--min-psnr 44.8"),
              Fails(4, "grid \"velocity.x\": PSNR box 44.77", Not(HasSubstr("\"velocity\""))));
  // The sum of a component was 0, and one length is as much larger as the other one is smaller.
  succeeded(check("shifted.vdb", "--max-mass-error 0.001"));
}

TEST_F(CompareCheck, printsATableOfAHundredColumns) {
  InputGrid longer = heat();
  longer.name =
      "temperature_of_the_combustion_products_in_kelvin_after_the_second_pass_of_the_solver";
  write("ref.vdb", {ball(), longer});
  write("off.vdb", {drifted(), longer});
  const auto run = succeeded(check("off.vdb", "--ssim --max-relative-error 50%"));
  std::istringstream lines(run.out);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
  EXPECT_THAT(run.out, Says('\n' + longer.name + '\n', "\ndensity  "));
}

TEST_F(CompareCheck, findsNoErrorInTheFileItself) {
  const auto report = reportOf("ref.vdb", "--ssim");
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
  ASSERT_NE(readText(at("ref.vdb")), readText(at("again.vdb")));
  EXPECT_THAT(succeeded(check("again.vdb", "--min-psnr 200 --max-error 0 --fail-on all")).out,
              HasSubstr("exact"));
}

TEST_F(CompareCheck, readsEsvrAndNanoVdbToo) {
  succeeded(quickFit(at("ref.vdb"), at("fit.esvr")));
  succeeded(esvr2vdb({at("fit.esvr"), at("back.nvdb")}));
  const auto esvr = reportOf("fit.esvr"), nano = reportOf("back.nvdb");
  for (const char* figure : {"psnr_box", "psnr_t10", "psnr_t50", "psnr_t90", "max_error", "iou"})
    EXPECT_EQ(esvr["grids"][0][figure], nano["grids"][0][figure]) << figure;
  EXPECT_TRUE(esvr["grids"][0]["differences"].empty());
  const auto reversed = compare("check", {at("back.nvdb"), at("fit.esvr"), "--min-psnr", "200"});
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
  succeeded(check("off.vdb", {"-g", "density", dashed, met}));
  const auto run = check("off.vdb", {"-g", "density", dashed, missed, "-q"});
  EXPECT_THAT(run, Fails(4, "grid \"density\"", dashed + " "));
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
  succeeded(check("off.vdb", "--max-error 1.1%"));
  EXPECT_THAT(check("off.vdb", "--max-error 0.9%"), Fails(4));
}

// An error of 0.01 is 2 % of a half, and a larger share of the smallest values.
TEST_F(CompareCheck, boundsTheErrorRelativeToEachValue) {
  write("off.vdb", {drifted(), heat()});
  succeeded(check("off.vdb", "--max-relative-error 2.1%,0.5"));
  EXPECT_THAT(check("off.vdb", "--max-relative-error 1.9%,0.5"),
              Fails(4, "relative error 0.02, --max-relative-error 0.019"));
  EXPECT_THAT(check("off.vdb", "--max-relative-error 2.1%"), Fails(4));
  EXPECT_EQ(check("ref.vdb", "--max-relative-error 1e-9").exitCode, 0) << "the same bytes";
  EXPECT_THAT(check("off.vdb", "--max-relative-error 100%"), Fails(2));
}

TEST_F(CompareCheck, boundsTheFilesBytes) {
  succeeded(check("ref.vdb", "--max-bytes 1MB"));
  EXPECT_THAT(check("ref.vdb", "--max-bytes 100"), Fails(4, "--max-bytes 100"));
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
  succeeded(check("moved.vdb", "--max-mesh-distance 0.4"));
  EXPECT_THAT(check("moved.vdb", "--max-mesh-distance 0.15"), Fails(4, "--max-mesh-distance 0.15"));
  EXPECT_FALSE(reportOf("moved.vdb")["grids"][0].contains("mesh_distance"));
}

TEST_F(CompareCheck, failsWhereAGridIsMissing) {
  write("one.vdb", {ball()});
  EXPECT_THAT(check("one.vdb"), Fails(4, "\"heat\" is missing"));
  succeeded(check("one.vdb", "-g density"));
}

TEST_F(CompareCheck, comparesGridsOfOtherNamesWhereTold) {
  InputGrid renamed = ball();
  renamed.name = "smoke";
  write("renamed.vdb", {renamed});
  EXPECT_THAT(succeeded(check("renamed.vdb", "-g density=smoke")).out,
              HasSubstr("name: \"density\", \"smoke\""));
  EXPECT_THAT(check("renamed.vdb", "-g density=smoke --fail-on name"), Fails(4));
}

TEST_F(CompareCheck, tellsDifferencesBesidesTheVoxels) {
  InputGrid other = ball();
  other.map = InputMap::kRotated;
  other.levelSet = true;
  other.background = 3.0f;
  write("other.vdb", {other, heat()});
  EXPECT_THAT(succeeded(check("other.vdb")).out,
              Says("transform: ", "class: fog volume, level set", "background: 0, 3"));
  for (const char* kind : {"transform", "class", "background", "all", "name,transform"})
    EXPECT_THAT(check("other.vdb", {"--fail-on", kind}), Fails(4)) << kind;
  succeeded(check("other.vdb", "--fail-on name,metadata"));
}

TEST_F(CompareCheck, tellsMetadataThatDoNotComeBack) {
  succeeded(quickFit(at("ref.vdb"), at("fit.esvr")));
  succeeded(esvr2vdb({at("fit.esvr"), at("back.nvdb")}));
  EXPECT_THAT(check("back.nvdb", "--fail-on metadata"),
              Fails(4, "file metadata \"creator\": missing", "metadata \"note\": missing"));
  succeeded(esvr2vdb({at("fit.esvr"), at("back.vdb")}));
  EXPECT_EQ(check("back.vdb", "--fail-on all").exitCode, 0) << "our own mark is no difference";
}

TEST_F(CompareCheck, failsWhereTheVoxelsLieElsewhere) {
  write("moved.vdb", {{.voxels = softBall({100, 0, 0})}, heat()});
  EXPECT_THAT(check("moved.vdb"), Fails(4, "boxes that do not meet"));
}

TEST_F(CompareCheck, failsWhereTheCandidateIsEmpty) {
  write("empty.vdb", {{.voxels = {}}, heat()});
  EXPECT_THAT(check("empty.vdb"), Fails(4, "the candidate has no active voxel"));
}

TEST_F(CompareCheck, comparesZerosWithAPeakOfOne) {
  const std::vector<InputVoxel> zeros{{{0, 0, 0}, 0.0f}, {{1, 0, 0}, 0.0f}};
  write("ref.vdb", {ball(), {.name = "flame", .voxels = zeros}});
  succeeded(check("ref.vdb", "--max-error 0"));
  succeeded(quickFit(at("ref.vdb"), at("fit.esvr")));
  succeeded(check("fit.esvr", "-g flame --max-error 0"));
  write("off.vdb", {ball(), {.name = "flame", .voxels = {{{0, 0, 0}, 0.1f}, {{1, 0, 0}, 0.1f}}}});
  const auto report = reportOf("off.vdb", "-g flame");
  EXPECT_NEAR(report["grids"][0]["psnr_active"].get<double>(), 20.0, 1e-5);
}

TEST_F(CompareCheck, comparesGridsThatAreNotFiniteByTheirBytes) {
  const auto odd = [](float value) {
    return InputGrid{.name = "odd", .voxels = {{{1, 2, 3}, value}, {{1 << 30, 0, 0}, 1.0f}}};
  };
  const float nan = std::nanf("");
  write("ref.vdb", {odd(nan), {.name = "far", .voxels = softBall({}), .background = nan}, ball()});
  const auto same = succeeded(check("ref.vdb", "--max-error 0"));
  succeeded(
      vdb2esvr({at("ref.vdb"), at("f.esvr"), "--keep", "odd", "--keep", "far", "-g", "density"}));
  EXPECT_THAT(succeeded(check("f.esvr", "--min-psnr-active 30")).out,
              Says("grid \"odd\": the same bytes (float)", "grid \"far\": the same bytes (float)"));

  write("other.vdb",
        {odd(2.0f), {.name = "far", .voxels = softBall({}), .background = nan}, ball()});
  const auto run = check("other.vdb");
  EXPECT_THAT(run, Fails(3, "grid \"odd\" cannot be compared: "));
  EXPECT_THAT(run.out, HasSubstr("density")) << "the others are compared";
  EXPECT_THAT(check("other.vdb", "--max-bytes 1"), Fails(4));
}

TEST_F(CompareCheck, holdsARunAgainstItsBaseline) {
  const Words baseline{"--baseline", at("base.json")};
  write("off.vdb", {drifted(), heat()});
  succeeded(check("off.vdb", {"--baseline", at("base.json"), "--update"}));
  succeeded(check("off.vdb", baseline));

  InputGrid worse = drifted();
  worse.voxels.front().value += 0.1f;
  write("worse.vdb", {worse, heat()});
  EXPECT_THAT(check("worse.vdb", baseline),
              Fails(4, "max error", "baseline 0.01", Not(HasSubstr("IoU"))));

  const auto better = succeeded(check("ref.vdb", baseline));
  EXPECT_THAT(better.out, HasSubstr("better"));
}

TEST_F(CompareCheck, keepsTheTolerancesOfABaseline) {
  write("off.vdb", {drifted(), heat()});
  succeeded(check("off.vdb", {"--baseline", at("base.json"), "--update"}));
  auto stored = Json::parse(readText(at("base.json")));
  stored["grids"]["density"]["max_error"]["tolerance"] = 5.0;
  writeText(at("base.json"), stored.dump());
  succeeded(check("ref.vdb", {"--baseline", at("base.json"), "--update"}));
  const auto updated = Json::parse(readText(at("base.json")));
  EXPECT_EQ(updated["grids"]["density"]["max_error"]["tolerance"], 5.0);
  EXPECT_EQ(updated["grids"]["density"]["max_error"]["value"], 0.0);
  EXPECT_TRUE(updated["grids"]["density"]["psnr_box"]["value"].is_null());
  EXPECT_THAT(check("off.vdb", {"--baseline", at("base.json")}), Fails(4)) << "exact before";
}

TEST_F(CompareCheck, wantsEveryGridOfTheBaseline) {
  succeeded(check("ref.vdb", {"--baseline", at("base.json"), "--update"}));
  EXPECT_THAT(check("ref.vdb", {"--baseline", at("base.json"), "-g", "density"}),
              Fails(4, "\"heat\" of the baseline was not compared"));
}

TEST_F(CompareCheck, leavesTheBaselineWhereALimitIsMissed) {
  write("off.vdb", {drifted(), heat()});
  EXPECT_THAT(check("off.vdb", {"--baseline", at("base.json"), "--update", "--max-error", "0.001"}),
              Fails(4));
  EXPECT_FALSE(std::filesystem::exists(at("base.json")));
}

TEST_F(CompareCheck, reportsFailuresInJson) {
  write("off.vdb", {drifted(), heat()});
  const auto report = reportOf("off.vdb", "--max-error 0.001");
  EXPECT_EQ(report["schema"], "esvr-check");
  ASSERT_EQ(report["failures"].size(), 1u);
  EXPECT_NEAR(report["grids"][0]["max_error"].get<double>(), 0.01, 1e-7);  // float32 near 1
}

class RefusedCheck : public CompareCheck, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedCheck, isExplainedAndLeavesNoFile) {
  write("zero.vdb", {{.voxels = {{{0, 0, 0}, 0.0f}, {{1, 0, 0}, 0.0f}}}});
  write("none.vdb", {{.voxels = {}}});
  write("else.vdb", {{.name = "fuel", .voxels = softBall({})}});
  writeText(at("broken.vdb"), "no such thing");
  writeText(at("notes.json"), "[1, 2]");
  GetParam().expectOf(compare("check", GetParam().argumentsIn(folder_)));
  EXPECT_THAT(folder_.names(), ElementsAre("broken.vdb", "else.vdb", "none.vdb", "notes.json",
                                           "ref.vdb", "zero.vdb"));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedCheck,
    testing::Values(Refusal{{}, 2, "REF"}, Refusal{"DIR/ref.vdb", 2, "CAND"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb --max-error much", 2, "--max-error"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb --min-psnr inf", 2, "--min-psnr"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb --fail-on colour", 2, "colour"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb --update", 2, "--baseline"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb --peak 0", 2, "--peak"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb --report DIR/x.txt", 2, ".json"},
                    Refusal{"DIR/missing.vdb DIR/ref.vdb", 3, "missing.vdb"},
                    Refusal{"DIR/ref.vdb DIR/missing.esvr", 3, "missing.esvr"},
                    Refusal{"DIR/ref.vdb DIR/broken.vdb", 3, "broken.vdb"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb -g smoke", 3, "\"density\""},
                    Refusal{"DIR/ref.vdb DIR/else.vdb", 3, "\"fuel\""},
                    Refusal{"DIR/none.vdb DIR/none.vdb --ignore-grids density", 3,
                            "no grid can be compared"},
                    Refusal{"DIR/none.vdb DIR/ref.vdb -g density", 4, "the reference has none"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb --baseline DIR/no.json", 3, "no.json"},
                    Refusal{"DIR/ref.vdb DIR/ref.vdb --baseline DIR/notes.json", 3, "baseline"}));

TEST(CompareProgram, namesItsCommands) {
  EXPECT_THAT(
      runProgram(ESVR_COMPARE, "chekc a b"),
      Fails(2, "unknown command 'chekc'; the commands are check and table; did you mean check?"));
  EXPECT_THAT(runProgram(ESVR_COMPARE, {}), Fails(2));
  succeeded(runProgram(ESVR_COMPARE, "--help"));
  EXPECT_THAT(runProgram(ESVR_COMPARE, "check --help").out, HasSubstr("--min-psnr"));
}

TEST_F(CompareCheck, refusesABaselineThatChecksNothing) {
  succeeded(check("ref.vdb", {"--baseline", at("base.json"), "--update"}));
  const auto good = Json::parse(readText(at("base.json")));
  const auto expectRefused = [&](const Json& baseline, const char* words) {
    writeText(at("bad.json"), baseline.dump());
    EXPECT_THAT(check("ref.vdb", {"--baseline", at("bad.json")}), Fails(3, "bad.json", words))
        << baseline;
  };
  for (const Json& value : {Json(5), Json(), Json(-1), Json("density"), Json::array()}) {
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
  empty["grids"]["density"] = Json::object();
  expectRefused(empty, "has no figures");
  auto misspelt = good;
  misspelt["grids"]["density"]["max_eror"] = good["grids"]["density"]["max_error"];
  expectRefused(misspelt, "which is no figure");
  for (const Json& tolerance : {Json(), Json(-1.0), Json("1")}) {
    auto bad = good;
    bad["grids"]["density"]["max_error"]["tolerance"] = tolerance;
    expectRefused(bad, "tolerance");
  }
  succeeded(check("ref.vdb", {"--baseline", at("base.json")}));
}

/// A folder with a source file of bool, int32, vec3s, points, density and empty grids.
class CompareCarried : public FolderTest {
 protected:
  void SetUp() override {
    writeMixedInput(at("ref.vdb"), {{.voxels = softBall({})}, {.name = "empty"}});
  }
  [[nodiscard]] ProgramRun check(const std::string& candidate, const Words& more = {}) const {
    return compare("check", joined({at("ref.vdb"), at(candidate)}, more));
  }
  void convert(const Words& more = {}) const {
    succeeded(vdb2esvr(joined({at("ref.vdb"), at("f.esvr"), "--lossless", "--force"}, more)));
  }
};

const Words kStrict{"--max-error", "0", "--fail-on", "all"};

TEST_F(CompareCarried, CarriedGridsAreEqualBitForBitInBothFormats) {
  convert();
  succeeded(esvr2vdb({at("f.esvr"), at("back.vdb")}));
  for (const char* candidate : {"f.esvr", "back.vdb"})
    EXPECT_THAT(
        succeeded(check(candidate, kStrict)).out,
        Says("grid \"vec3s\": the same bytes (vec3s)", "grid \"empty\": the same bytes (float)"));
}

TEST_F(CompareCarried, AGridWhoseVoxelsAreCarriedIsComparedByItsBytes) {
  convert("--keep density");
  EXPECT_THAT(succeeded(check("f.esvr", kStrict)).out,
              HasSubstr("grid \"density\": the same bytes (float)"));
}

TEST_F(CompareCarried, AMissingGridFailsUnlessItIsIgnored) {
  convert("--skip vec3s --skip empty");
  EXPECT_THAT(check("f.esvr"), Fails(4, "\"vec3s\" is missing", "\"empty\" is missing"));
  EXPECT_THAT(check("f.esvr", "--ignore-grids vec3s"), Fails(4));
  succeeded(check("f.esvr", "--ignore-grids vec3s --ignore-grids empty"));
}

TEST_F(CompareCarried, AnExtraGridFailsUnlessItIsIgnored) {
  writeMixedInput(
      at("more.vdb"),
      {{.voxels = softBall({})}, {.name = "empty"}, {.name = "fuel", .voxels = softBall({})}});
  EXPECT_THAT(check("more.vdb"), Fails(4, "grid \"fuel\" is not in the reference"));
  succeeded(check("more.vdb", "--ignore-grids fuel"));
}

TEST_F(CompareCarried, ARetypedGridFailsUnlessItIsIgnored) {
  const std::vector<InputGrid> grids{
      {.voxels = softBall({})}, {.name = "empty"}, {.name = "x", .voxels = softBall({})}};
  writeInput(at("floats.vdb"), {grids[2]});
  for (const char* type : {"vec3s", "double"}) {
    openvdb::io::File(at("other.vdb"))
        .write({emptyGrid(std::string("Tree_") + type + "_5_4_3", "x")});
    EXPECT_THAT(compare("check", {at("floats.vdb"), at("other.vdb")}),
                Fails(4, std::string("of type ") + type + " in the candidate, float in"));
  }
  EXPECT_THAT(compare("check", {at("floats.vdb"), at("other.vdb"), "--ignore-grids", "x"}),
              Fails(3))
      << "nothing is left to compare";
}

TEST_F(CompareCarried, OtherBytesFail) {
  const auto write = [&](const char* file, int number) {
    const auto grid = emptyGrid("Tree_int32_5_4_3", "x");
    grid->insertMeta("number", openvdb::Int32Metadata(number));
    openvdb::io::File(at(file)).write({grid});
  };
  write("a.vdb", 1);
  write("b.vdb", 2);
  write("c.vdb", 1);
  succeeded(compare("check", {at("a.vdb"), at("c.vdb")}));
  EXPECT_THAT(compare("check", {at("a.vdb"), at("b.vdb")}),
              Fails(4, "grid \"x\": its bytes differ"));
}

TEST_F(CompareCarried, AnEmptyGridOfOtherBytesHasNoVoxelsEither) {
  const auto write = [&](const char* file, std::vector<InputVoxel> voxels, float background) {
    writeInput(at(file), {{.voxels = softBall({})},
                          {.name = "e", .voxels = std::move(voxels), .background = background}});
  };
  write("a.vdb", {}, 0.0f);
  write("b.vdb", {}, 2.0f);
  write("c.vdb", softBall({}), 0.0f);
  EXPECT_THAT(succeeded(compare("check", {at("a.vdb"), at("b.vdb")})).out,
              Says("grid \"e\": no active voxel in either file", "grid \"e\": background: 0, 2"));
  EXPECT_THAT(compare("check", {at("a.vdb"), at("b.vdb"), "--fail-on", "all"}), Fails(4));
  EXPECT_THAT(compare("check", {at("a.vdb"), at("c.vdb")}),
              Fails(4, "active voxels, the reference has none"));
}

TEST_F(CompareCarried, TablesTakeTheGridThatIsNotCarried) {
  convert();
  EXPECT_THAT(succeeded(compare("table", {at("ref.vdb"), at("f.esvr"), "--rows", "none"})).out,
              HasSubstr("f.esvr"));
  convert("--keep density");
  const auto carried = compare("table", {at("ref.vdb"), at("f.esvr"), "--rows", "none"});
  EXPECT_THAT(carried.out + carried.err, HasSubstr("is carried unchanged"));
}

/// Three frames of balls with the peaks 2, 3 and 4 as a.1.vdb, ...; b.#.vdb are brighter by a part.
class SequenceCheck : public FolderTest {
 protected:
  void SetUp() override { writeFrames("a", {0.0f, 0.0f, 0.0f}); }
  void writeFrames(const std::string& name, const std::vector<float>& brighter) const {
    for (std::size_t i = 0; i < brighter.size(); ++i) {
      auto voxels = softBall({}, float(i + 2));
      for (auto& voxel : voxels) voxel.value += brighter[i];
      writeInput(at(name + "." + std::to_string(i + 1) + ".vdb"), {{.voxels = voxels}});
    }
  }
  [[nodiscard]] ProgramRun check(const std::string& candidate, const Words& more = {}) const {
    return compare("check", joined({at("a.@.vdb"), at(candidate)}, more));
  }
  void store(const std::string& frames) const {
    succeeded(vdb2esvr(
        {at("a.@.vdb"), at("a.esvr"), "--lossless", "--device", "cpu", "--frames", frames}));
  }
};

TEST_F(SequenceCheck, findsNoErrorInAFileThatHasEveryBit) {
  store("1-3");
  EXPECT_THAT(
      succeeded(check("a.esvr", {"--min-psnr-temporal", "300", "--report", at("r.json")})).out,
      Says("temporal", "frame 3: density"));
  const Json report = Json::parse(readText(at("r.json")));
  ASSERT_EQ(report["grids"].size(), 3u);
  EXPECT_FALSE(report["grids"][0].contains("psnr_temporal")) << "there is no frame before it";
  EXPECT_TRUE(report["grids"][2]["psnr_temporal"].is_null()) << "infinite";
  EXPECT_EQ(report["grids"][2]["frame"], 3);
  EXPECT_EQ(report["bytes"], sizeOf("a.esvr"));
}

TEST_F(SequenceCheck, doesNotCountErrorsThatAllFramesShare) {
  writeFrames("b", {0.25f, 0.25f, 0.25f});
  succeeded(check("b.@.vdb", "--min-psnr-temporal 100"));
  EXPECT_THAT(check("b.@.vdb", "--min-psnr 100"), Fails(4));
}

TEST_F(SequenceCheck, countsErrorsThatChange) {
  writeFrames("b", {0.25f, 0.25f, 0.5f});
  const auto run = check("b.@.vdb", "--min-psnr-temporal 100");
  EXPECT_THAT(run, Fails(4, "frame 3: grid \"density\": temporal"));
  EXPECT_THAT(run.err, testing::Not(HasSubstr("frame 2: grid")));
}

TEST_F(SequenceCheck, namesFramesThatOnlyOneSequenceHas) {
  store("1-2");
  EXPECT_THAT(check("a.esvr"), Fails(4, "1 of 3 frames are not in " + at("a.esvr") + ": 3"));
  succeeded(check("a.esvr", "--frames 1-2"));
}

TEST_F(SequenceCheck, refusesASingleFileBesideASequence) {
  EXPECT_THAT(check("a.1.vdb"), Fails(2));
  EXPECT_THAT(compare("check", {at("a.1.vdb"), at("a.1.vdb"), "--min-psnr-temporal", "40"}),
              Fails(2, "--min-psnr-temporal need sequences"));
}

}  // namespace
}  // namespace esvr::test
