// Plan: vdb2esvr is run as a separate process. The tests check exit codes and messages of refused
// input, which leaves no file behind, the output and report of a run, and the result of an
// interrupted run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/refusal.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using test::InputGrid;
using test::InputVoxel;
using test::quickFit;
using test::Refusal;
using test::softBall;
using test::vdb2esvr;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// A folder with one valid input file.
class Vdb2Esvr : public testing::Test {
 protected:
  void SetUp() override { test::writeInput(in(), {{.voxels = softBall({})}}); }
  [[nodiscard]] std::string in() const { return folder_ / "in.vdb"; }
  [[nodiscard]] std::string out() const { return folder_ / "out.esvr"; }
  [[nodiscard]] bool outIsThere() const { return std::filesystem::exists(out()); }

  test::TemporaryFolder folder_;
};

TEST_F(Vdb2Esvr, printsATableAndWritesTheFile) {
  const auto run = quickFit(in(), out());
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("PSNR box"), HasSubstr("density"), HasSubstr("bytes, 1 :")));
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "out.esvr"));
}

// ---- input

struct BadFile {
  const char* name;
  std::function<void(const std::string& path)> make;
  const char* words;
};
std::ostream& operator<<(std::ostream& out, const BadFile& file) { return out << file.name; }

class BadInputFile : public testing::TestWithParam<BadFile> {};

TEST_P(BadInputFile, isRefusedByNameWithCodeThreeAndNothingIsWritten) {
  const test::TemporaryFolder folder;
  const std::string in = folder / "in.vdb";
  GetParam().make(in);
  const auto run = quickFit(in, folder / "out.esvr");
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("in.vdb"), HasSubstr(GetParam().words)));
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(folder.names(), Not(testing::Contains(HasSubstr("esvr"))));
}

/// A grid with voxels that are not finite. The first of them in index order is (1, 2, 3).
InputGrid withNonFinite() {
  InputGrid grid{.voxels = softBall({})};
  grid.voxels.push_back({{9, 9, 9}, kInf});
  grid.voxels.push_back({{1, 2, 3}, kNan});
  return grid;
}

void truncated(const std::string& path) {
  test::writeInput(path, {{.voxels = softBall({})}});
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadInputFile,
    testing::Values(
        BadFile{"missing", [](const std::string&) {}, "no such file"},
        BadFile{"directory", [](const auto& path) { std::filesystem::create_directory(path); },
                "is a directory"},
        BadFile{"empty", [](const auto& path) { test::writeText(path, ""); }, "is empty"},
        BadFile{"text", [](const auto& path) { test::writeText(path, "density 1 2 3\n"); },
                "neither an OpenVDB nor a NanoVDB"},
        BadFile{"truncated", truncated, "in.vdb"},
        BadFile{"no grid", [](const auto& path) { test::writeInput(path, {}); },
                "no grid that can be fitted"},
        BadFile{"no active voxel", [](const auto& path) { test::writeInput(path, {InputGrid{}}); },
                "has no active voxel"},
        BadFile{"only grids of other types",
                [](const auto& path) { test::writeMixedInput(path, {}); }, "ptdataidx32"},
        BadFile{"not finite", [](const auto& path) { test::writeInput(path, {withNonFinite()}); },
                "2 voxels are NaN, infinite or too large for float; the first is at (1, 2, 3)"}));

TEST_F(Vdb2Esvr, listsTheGridsWhereTheOneAskedForIsNotThere) {
  test::writeInput(in(), {{.name = "a", .voxels = softBall({})}, {.name = "b"}});
  const auto run = quickFit(in(), out(), {"-g", "c"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("no grid \"c\""), HasSubstr("\"a\""), HasSubstr("\"b\"")));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Vdb2Esvr, listsGridsOfOtherTypesAsSkippedAndGoesOn) {
  test::writeMixedInput(in(), {{.voxels = softBall({})}});
  const auto run = quickFit(in(), out());
  EXPECT_EQ(run.exitCode, 0);
  for (const char* type : {"bool", "int32", "vec3s", "ptdataidx32"})
    EXPECT_THAT(run.err, HasSubstr(type));
  EXPECT_EQ(readEsvr(out()).grids.size(), 1u);
}

TEST_F(Vdb2Esvr, refusesAGridOfAnotherTypeThatIsAskedFor) {
  test::writeMixedInput(in(), {{.voxels = softBall({})}});
  const auto run = quickFit(in(), out(), {"-g", "vec3s"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("vec3s"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Vdb2Esvr, takesNonFiniteVoxelsAsZeroWhereAskedAndSaysHowMany) {
  test::writeInput(in(), {withNonFinite()});
  const auto run = quickFit(in(), out(), {"--nonfinite", "zero"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("2 NaN or infinite voxels were replaced by 0"));
  EXPECT_TRUE(outIsThere());
}

TEST_F(Vdb2Esvr, fitsTheGridsThatAreNamedOnly) {
  test::writeInput(in(), {{.voxels = softBall({})},
                          {.voxels = softBall({30, 0, 0})},
                          {.name = "heat", .voxels = softBall({})}});
  ASSERT_EQ(quickFit(in(), out(), {"-g", "heat", "-g", "density[1]"}).exitCode, 0);
  const EsvrFile file = readEsvr(out());
  ASSERT_EQ(file.grids.size(), 2u);
  EXPECT_EQ(file.grids[0].activeBox.min.x, 26);
  EXPECT_EQ(file.grids[1].descriptor.name, "heat");
}

// ---- options

class RefusedOptions : public Vdb2Esvr, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedOptions, areNamedAndLeaveNoFile) {
  std::vector<std::string> arguments{in(), out()};
  arguments.insert(arguments.end(), GetParam().arguments.begin(), GetParam().arguments.end());
  GetParam().expectOf(vdb2esvr(arguments));
  EXPECT_FALSE(outIsThere());
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedOptions,
    testing::Values(
        Refusal{{"--size", "5XB"}, 2, "--size"},
        Refusal{{"--size", "9KB", "--psnr", "40"}, 2, "--psnr"},
        Refusal{{"--size", "9KB", "--ratio", "9"}, 2, "--ratio"},
        Refusal{{"--ratio", "0.5"}, 2, "--ratio"}, Refusal{{"--max-error", "0"}, 2, "--max-error"},
        Refusal{{"--max-error", "1x"}, 2, "--max-error"},
        Refusal{{"--representation", "voxels", "--count", "9"}, 2, "--count"},
        Refusal{{"--representation", "cubes"}, 2, "cubes"},
        Refusal{{"--representation", "ellipsoids", "--lossless"}, 2, "--lossless"},
        Refusal{
            {"--representation", "voxels", "--psnr", "40", "--storage", "float32"}, 2, "float32"},
        Refusal{{"--lossless", "--psnr", "40"}, 2, "--psnr"}, Refusal{{"--size", "99"}, 2, "bytes"},
        Refusal{{"--count", "0"}, 2, "--count"}, Refusal{{"--count", "x"}, 2, "x"},
        Refusal{{"--psnr", "-1"}, 2, "--psnr"}, Refusal{{"--psnr", "nan"}, 2, "psnr"},
        Refusal{{"--seconds", "0"}, 2, "--seconds"},
        Refusal{{"--fit-for", "drawing", "--lossless"}, 2, "--lossless"},
        Refusal{{"--fit-for", "drawing", "--representation", "voxels"}, 2, "--representation"},
        Refusal{{"--fit-for", "drawing", "--paper", "default"}, 2, "--fit-for"},
        Refusal{{"--fit-for", "drawing", "--voxel-share", "1.5"}, 2, "--voxel-share"},
        Refusal{{"--voxel-share", "0.5"}, 2, "--fit-for"},
        Refusal{{"--iterations", "0"}, 2, "--iterations"}, Refusal{{"--preset", "best"}, 2, "best"},
        Refusal{{"--box", "1,2,3"}, 2, "--box"}, Refusal{{"--box", "5,5,5,1,1,1"}, 2, "no voxel"},
        Refusal{{"--max-error", "1%", "--paper", "epochs=9"}, 2, "--paper"},
        Refusal{{"--max-error", "1%", "--preset", "paper", "--iterations", "9"}, 2, "paper"},
        Refusal{{"--lossless", "--max-error", "1%"}, 2, "--max-error"},
        Refusal{{"--paper", "default", "--kappa", "2"}, 2, "--kappa"},
        Refusal{{"--paper", "default", "--iterations", "9"}, 2, "--iterations"},
        Refusal{{"--paper", "default", "--preset", "high"}, 2, "--preset"},
        Refusal{{"--paper", "default", "--size", "9KB"}, 2, "--paper"},
        Refusal{{"--paper", "sharpness=3"}, 2, "no key 'sharpness'"},
        Refusal{{"--paper", "k"}, 2, "KEY=VALUE"}, Refusal{{"--paper", "k=soft"}, 2, "soft"},
        Refusal{{"--paper", "k=3,k=4"}, 2, "twice"}, Refusal{{"--paper", "beta=2"}, 2, "beta"},
        Refusal{{"--paper", "epochs=0"}, 2, "epochs"},
        Refusal{{"--paper", "rates=1:2:3"}, 2, "four rates"},
        Refusal{{"--paper", "k=learned", "--storage", "compact"}, 2, "edge"},
        Refusal{{"--paper", "kernel=gaussian,k=3"}, 2, "Gaussians"},
        Refusal{{"--paper", "prunes=2"}, 2, "prunes"},
        Refusal{{"--paper", "prune-score=best"}, 2, "best"}, Refusal{{"--device", "tpu"}, 2, "tpu"},
        Refusal{{"--device", "cuda:4096"}, 5, "cuda:4096"},
        Refusal{{"--report", "report.txt"}, 2, ".json"},
        Refusal{{"more"}, 2, "unexpected argument"}));

TEST_F(Vdb2Esvr, endsWithCodeFourWhereThePsnrIsMissedAndWritesTheFile) {
  const auto run = quickFit(in(), out(), {"--psnr", "200"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, AllOf(HasSubstr("instead of 200.00 dB"), HasSubstr("was written")));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

TEST_F(Vdb2Esvr, keepsToTheSizeAskedFor) {
  const auto run = vdb2esvr({in(), out(), "--size", "1.5KB", "--iterations", "60", "--kappa", "0",
                             "--representation", "ellipsoids"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LE(std::filesystem::file_size(out()), 1500u);
  EXPECT_GE(std::filesystem::file_size(out()), 1470u);
}

TEST_F(Vdb2Esvr, losslessGivesBackEveryBit) {
  const auto run = vdb2esvr({in(), out(), "--lossless"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const SparseVolume source = readGrid(in(), "density", {}).volume;
  const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
  EXPECT_EQ(back.values, source.values);
  EXPECT_EQ(back.active, source.active);
}

TEST_F(Vdb2Esvr, keepsEveryVoxelWithinTheBound) {
  const auto run = vdb2esvr({in(), out(), "--max-error", "1%", "--topology", "exact"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const SparseVolume source = readGrid(in(), "density", {}).volume;
  const ValueRange range = activeRange(source);
  const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
  EXPECT_LE(compareVolumes(source, back).maxError, 0.01 * (double(range.max) - range.min));
  EXPECT_EQ(back.active, source.active);
}

TEST_F(Vdb2Esvr, storesTheMaskWhereAsked) {
  ASSERT_EQ(quickFit(in(), out(), {"--topology", "exact"}).exitCode, 0);
  const SparseVolume source = readGrid(in(), "density").volume;
  const StoredGrid grid = readEsvr(out()).grids[0];
  EXPECT_GT(grid.field.ellipsoidCount(), 0u);
  const SparseVolume back = decodeGrid(grid);
  EXPECT_EQ(back.bricks, source.bricks);
  EXPECT_EQ(back.active, source.active);
}

TEST_F(Vdb2Esvr, givesTheSameBytesInEveryRunOnAnyNumberOfThreads) {
  const std::string other = folder_ / "other.esvr";
  ASSERT_EQ(quickFit(in(), out(), {"--threads", "1"}).exitCode, 0);
  for (const char* threads : {"1", "3"}) {
    ASSERT_EQ(quickFit(in(), other, {"--threads", threads, "--force"}).exitCode, 0);
    EXPECT_EQ(test::readText(other), test::readText(out())) << threads << " threads";
  }
}

// ---- output

TEST_F(Vdb2Esvr, keepsAnExistingFileUnlessForced) {
  test::writeText(out(), "precious");
  const auto refused = quickFit(in(), out());
  EXPECT_EQ(refused.exitCode, 1);
  EXPECT_THAT(refused.err, HasSubstr("--force"));
  EXPECT_EQ(test::readText(out()), "precious");
  EXPECT_EQ(quickFit(in(), out(), {"--force"}).exitCode, 0);
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

TEST_F(Vdb2Esvr, refusesOutputsThatCannotBeWrittenBeforeAnyWork) {
  std::filesystem::create_directory(folder_ / "folder.esvr");
  for (const std::string name : {"none/out.esvr", "folder.esvr"}) {
    const auto run = quickFit(in(), folder_ / name, {"--force"});
    EXPECT_EQ(run.exitCode, 1) << name;
    EXPECT_THAT(run.err, HasSubstr(name));
  }
  EXPECT_THAT(quickFit(in(), "/proc/out.esvr").err, HasSubstr("/proc/out.esvr"));
  const auto wrongEnding = quickFit(in(), folder_ / "out.vdb");
  EXPECT_EQ(wrongEnding.exitCode, 2);
  EXPECT_THAT(wrongEnding.err, HasSubstr(".esvr"));
  EXPECT_THAT(folder_.names(), ElementsAre("folder.esvr", "in.vdb"));
}

TEST_F(Vdb2Esvr, refusesToWriteOverItsInput) {
  std::filesystem::create_hard_link(in(), out());
  const auto run = quickFit(in(), out(), {"--force"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("one file"));
}

TEST_F(Vdb2Esvr, leavesNothingOnAFullDisk) {
  test::writeText(folder_ / "old.esvr", "precious");
  for (const std::string name : {"out.esvr", "old.esvr"}) {
    const auto run =
        test::runOnFullDisk(std::string(VDB2ESVR) + " " + in() + " " + (folder_ / name).string() +
                            " --force --iterations 10 --kappa 0");
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_THAT(run.err, AllOf(HasSubstr(name), HasSubstr("File too large")));
  }
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "old.esvr"));
  EXPECT_EQ(test::readText(folder_ / "old.esvr"), "precious");
}

TEST_F(Vdb2Esvr, keepsTheFileWhereOnlyTheTableCannotBePrinted) {
  const auto run = test::runProgram(
      "/bin/sh", {"-c", std::string(VDB2ESVR) + " " + in() + " " + out() +
                            " --iterations 10 --representation ellipsoids > /dev/full"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("standard output"));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

// ---- report

using Json = nlohmann::json;

TEST_F(Vdb2Esvr, reportsWhatTheFileHolds) {
  const auto run = quickFit(in(), out(), {"--report", "-"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Json report = Json::parse(run.out);
  EXPECT_TRUE(report["error"].is_null());
  const Json& grid = report["grids"][0];
  EXPECT_TRUE(grid["paper"].is_null());
  EXPECT_EQ(report["schema"], "esvr-report");
  EXPECT_EQ(report["exit_code"], 0);
  EXPECT_EQ(report["output"]["bytes"], std::filesystem::file_size(out()));
  EXPECT_EQ(grid["ellipsoids"], readEsvr(out()).grids[0].field.ellipsoidCount());
  EXPECT_EQ(grid["source"]["active_voxels"], softBall({}).size());
  EXPECT_EQ(grid["curve"].size(), readEsvr(out()).grids[0].curve.size());
}

TEST_F(Vdb2Esvr, reportsWhatThePapersMethodUsed) {
  const auto run = vdb2esvr({in(), out(), "--paper", "epochs=28,points=60,beta=0.5", "--paper",
                             "prune-score=no-fa,densify-threshold=0,rates=1e-4:2e-3:1e-3:1e-2",
                             "--count", "40", "--report", "-", "--hits", "--device", "cpu"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Json report = Json::parse(run.out);
  EXPECT_EQ(report["asked"]["method"], "paper");
  EXPECT_EQ(report["asked"]["storage"], "float32");
  const Json& paper = report["grids"][0]["paper"];
  EXPECT_EQ(paper["k"], 5.0);
  EXPECT_EQ(paper["kernel"], "ellipsoid");
  EXPECT_EQ(paper["beta"], 0.5);
  EXPECT_EQ(paper["points"], 60);
  EXPECT_EQ(paper["rates"]["scale"], 2e-3);
  EXPECT_EQ(paper["prune_score"], "no-fa");
  EXPECT_EQ(paper["densify"]["until"], 4);  // 400 of 2800 epochs in the paper
  EXPECT_EQ(paper["prunes"][0]["epoch"], 12);
  EXPECT_EQ(paper["prunes"][0]["after"], 40);
  EXPECT_GT(report["grids"][0]["fit"]["hits"], 1.0);
  EXPECT_GT(report["grids"][0]["fit"]["voxel_pairs"], 1);
}

/// Converts `voxels` with --max-error 5% and checks the bound and the report.
/// \return true if ellipsoids and a residual were stored
bool storesEllipsoidsWithinABound(const std::string& in, const std::string& out,
                                  const std::vector<test::InputVoxel>& voxels,
                                  const std::string& iterations) {
  test::writeInput(in, {{.voxels = voxels}});
  const auto run = vdb2esvr(
      {in, out, "--max-error", "5%", "--kappa", "-6", "--iterations", iterations, "--report", "-"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const Json made = Json::parse(run.out)["grids"][0]["representation"];
  const StoredGrid grid = readEsvr(out).grids[0];
  EXPECT_NE(grid.voxels.has_value(), grid.residual.has_value());
  EXPECT_EQ(made["stored"], grid.voxels ? "voxels" : "ellipsoids and residual");
  if (grid.residual) {
    EXPECT_LT(made["ellipsoids"]["bytes"].get<int>(), made["voxels"]["bytes"].get<int>());
    EXPECT_GT(grid.field.ellipsoidCount(), 0u);
  }
  const SparseVolume source = readGrid(in, "density").volume;
  const ValueRange range = activeRange(source);
  EXPECT_LE(largestDifference(source, decodeGrid(grid)), 0.05 * (double(range.max) - range.min));
  return grid.residual.has_value();
}

/// The voxels of the cloud take about 2200 bytes, and ellipsoids about 650 bytes after a full fit.
TEST_F(Vdb2Esvr, SlowTakesEllipsoidsForABoundWhereTheyAreSmaller) {
  EXPECT_TRUE(storesEllipsoidsWithinABound(in(), out(), test::cloud(40), "1000"));
}

/// Every voxel of noise needs a correction, whatever the ellipsoids are.
TEST_F(Vdb2Esvr, takesVoxelsForABoundWhereTheyAreSmaller) {
  test::Random random(17);
  std::vector<test::InputVoxel> noise = softBall({});
  for (auto& voxel : noise) voxel.value = float(random(0.1, 1.0));
  EXPECT_FALSE(storesEllipsoidsWithinABound(in(), out(), noise, "100"));
}

TEST_F(Vdb2Esvr, triesNoEllipsoidsForABoundWhereTold) {
  const std::string report = folder_ / "r.json";
  const auto run = vdb2esvr(
      {in(), out(), "--max-error", "5%", "--representation", "voxels", "--report", report});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Json made = Json::parse(test::readText(report))["grids"][0]["representation"];
  EXPECT_EQ(made["stored"], "voxels");
  EXPECT_TRUE(made["ellipsoids"].is_null());
  EXPECT_TRUE(readEsvr(out()).grids[0].voxels.has_value());
}

TEST_F(Vdb2Esvr, dividesByTheGridsThatWereConverted) {
  test::writeInput(in(), {{.name = "density", .voxels = softBall({})},
                          {.name = "heat", .voxels = softBall({40, 0, 0})}});
  const std::string path = folder_ / "r.json";
  const auto run = quickFit(in(), out(), {"-g", "heat", "--report", path});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("1 of 2 grids"));
  const Json report = Json::parse(test::readText(path));
  const double converted = report["input"]["bytes_converted"], all = report["input"]["bytes"];
  EXPECT_LT(converted, 0.6 * all);  // two equal grids
  EXPECT_GT(converted, 0.2 * all);
  EXPECT_DOUBLE_EQ(report["ratio"], converted / double(report["output"]["bytes"]));
}

TEST_F(Vdb2Esvr, refusesWhatTakesMoreMemoryThanAllowed) {
  const auto run = quickFit(in(), out(), {"--max-memory", "1KB"});
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_THAT(run.err, HasSubstr("density"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Vdb2Esvr, reportsAFailureToo) {
  const std::string report = folder_ / "r.json";
  const auto run = vdb2esvr({in(), out(), "--size", "99", "--report", report});
  ASSERT_EQ(run.exitCode, 2);
  const Json json = Json::parse(test::readText(report));
  EXPECT_EQ(json["exit_code"], 2);
  EXPECT_EQ(json["error"]["kind"], "usage");
  EXPECT_THAT(std::string(json["error"]["message"]), HasSubstr("99"));
  EXPECT_EQ(json["input"]["path"], in());
}

TEST_F(Vdb2Esvr, listsTheKeysOfThePapersMethod) {
  const auto run = vdb2esvr({"--help", "paper"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("epochs (=2800)"), HasSubstr("prune-score (=full)")));
}

TEST_F(Vdb2Esvr, reportsNullForAPsnrWithoutError) {
  test::writeInput(in(), {{.voxels = softBall({}, 0.0f)}});
  const std::string report = folder_ / "r.json";
  ASSERT_EQ(quickFit(in(), out(), {"--report", report}).exitCode, 0);
  const Json json = Json::parse(test::readText(report));
  EXPECT_TRUE(json["grids"][0]["metrics"]["psnr_box"].is_null());
}

TEST_F(Vdb2Esvr, reportsTheErrorOfTheVoxelsThatComeBack) {
  const auto run = quickFit(in(), out(), {"--report", "-"});
  const Json metrics = Json::parse(run.out)["grids"][0]["metrics"];
  const std::string back = folder_ / "back.vdb";
  ASSERT_EQ(test::esvr2vdb({out(), back}).exitCode, 0);
  const VolumeMetrics m =
      compareVolumes(readGrid(in(), "density").volume, readGrid(back, "density").volume);
  EXPECT_EQ(metrics["psnr_box"].get<double>(), m.psnrBox);
  EXPECT_EQ(metrics["psnr_active"].get<double>(), m.psnrActive);
  EXPECT_EQ(metrics["max_error"].get<double>(), m.maxError);
  EXPECT_EQ(metrics["iou"].get<double>(), m.iou);
}

// ---- Ctrl-C

/// A fit of a minute, which is interrupted after its first message about progress.
class Interrupted : public Vdb2Esvr {
 protected:
  [[nodiscard]] test::ProgramRun interrupted(const std::string& onCancel) const {
    test::writeInput(in(), {{.voxels = softBall({})}, {.name = "heat", .voxels = softBall({})}});
    return test::runInterrupted(VDB2ESVR,
                                {in(), out(), "--seconds", "60", "--kappa", "0", "--representation",
                                 "ellipsoids", "--on-cancel", onCancel, "-v"},
                                " left\n");
  }
};

TEST_F(Interrupted, writesTheBestSoFarAndEndsWithCodeOne) {
  const auto run = interrupted("keep");
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("out.esvr has the best result so far, without grid \"heat\""));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "out.esvr"));
}

TEST_F(Interrupted, writesNothingWhereAskedTo) {
  const auto run = interrupted("discard");
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("nothing was written"));
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb"));
}

}  // namespace
}  // namespace esvr
