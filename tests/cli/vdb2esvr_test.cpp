// Plan: vdb2esvr is run as a separate process with a small grid: the goals, outputs that cannot or must
// not be written, interruptions, input that it refuses, and options that are wrong. What is refused or
// interrupted leaves no file but what the message names.

#include <chrono>
#include <cmath>
#include <csignal>
#include <functional>
#include <iostream>
#include <thread>

#include "cli/conversion.h"
#include "field/random_field.h"
#include "fit/volumes.h"
#include "support/non_finite.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST_F(Vdb2Esvr, printsATableAndWritesTheFile) {
  const auto run = succeeded(fitQuickly());
  EXPECT_THAT(run.out, Says("PSNR box", "PSNR T 0.5", "density", "bytes, 1 :"));
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "out.esvr"));
}

TEST_F(Vdb2Esvr, saysWhereExactVoxelsWouldTakeFewerBytes) {
  writeInput(in(), {{.voxels = cloud(8)}});
  const auto summaryOf = [&](const char* count) {
    return vdb2esvr({in(), out(), "--force", "--iterations", "5", "--count", count, "--storage",
                     "float32"})
        .out;
  };
  EXPECT_THAT(summaryOf("10"), Not(HasSubstr("exact voxels")));
  EXPECT_THAT(summaryOf("5000"), HasSubstr("exact voxels would take fewer bytes, about "));
}

TEST_F(Vdb2Esvr, listsTheKeysOfThePapersMethod) {
  EXPECT_THAT(succeeded(vdb2esvr("--help paper")).out,
              Says("epochs (=2800)", "prune-score (=full)"));
}

TEST_F(Vdb2Esvr, endsWithCodeFourWhereThePsnrIsMissedAndWritesTheFile) {
  EXPECT_THAT(fitQuickly("--psnr 200"), Fails(4, "instead of 200.00 dB", "was written"));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

TEST_F(Vdb2Esvr, namesTheFileWhereAConversionCannotReachItsGoal) {
  EXPECT_THAT(vdb2esvr({in(), out(), "--size", "20"}), Fails(2, in(), "the size allows 20"));
  EXPECT_THAT(vdb2esvr({in(), out(), "--size", "180"}), Fails(2, in(), "grid 'density'", "allows"));
}

TEST_F(Vdb2Esvr, keepsToTheSizeAskedFor) {
  succeeded(vdb2esvr(
      {in(), out(), "--size", "1.5KB", "--iterations", "60", "--representation", "ellipsoids"}));
  EXPECT_LE(std::filesystem::file_size(out()), 1500u);
  EXPECT_GE(std::filesystem::file_size(out()), 1470u);
}

TEST_F(Vdb2Esvr, losslessGivesBackEveryBit) {
  succeeded(vdb2esvr({in(), out(), "--lossless"}));
  EXPECT_EQ(
      volumeDifference(decodeGrid(readEsvr(out()).grids[0]), readGrid(in(), "density").volume), "");
}

TEST_F(Vdb2Esvr, keepsEveryVoxelWithinTheBound) {
  succeeded(vdb2esvr({in(), out(), "--max-error", "1%", "--topology", "exact"}));
  const SparseVolume source = readGrid(in(), "density", {}).volume;
  const ValueRange range = activeRange(source);
  const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
  EXPECT_LE(compareVolumes(source, back).maxError, 0.01 * (double(range.max) - range.min));
  EXPECT_EQ(back.active, source.active);
}

TEST_F(Vdb2Esvr, storesTheMaskWhereAsked) {
  succeeded(fitQuickly("--topology exact"));
  const SparseVolume source = readGrid(in(), "density").volume;
  const StoredGrid grid = readEsvr(out()).grids[0];
  EXPECT_GT(grid.field.ellipsoidCount(), 0u);
  const SparseVolume back = decodeGrid(grid);
  EXPECT_EQ(back.bricks, source.bricks);
  EXPECT_EQ(back.active, source.active);
}

/// A ball in a cloud with a rough boundary, which is fainter than the error.
std::vector<InputVoxel> ballInACloud() {
  std::vector<InputVoxel> voxels;
  for (Coord v; v.x < 40; ++v.x)
    for (v.y = 0; v.y < 40; ++v.y)
      for (v.z = 0; v.z < 40; ++v.z) {
        const double r = std::hypot(v.x - 20.0, v.y - 20.0, v.z - 20.0);
        if (r < 6.0)
          voxels.push_back({v, float(7.0 - r)});
        else if (r < 16.0 + std::sin(2.0 * v.x) + std::sin(3.0 * v.y + v.z))
          voxels.push_back({v, 1e-4f});
      }
  return voxels;
}

TEST_F(Vdb2Esvr, saysWhatAMaskTakes) {
  writeInput(in(), {{.voxels = ballInACloud()}});
  const std::string report = folder_ / "report.json";
  EXPECT_THAT(fitQuickly({"--report", report, "--topology", "exact"}).out,
              HasSubstr("density: the mask of active voxels takes "));
  const Json topology = Json::parse(readText(report))["grids"][0]["topology"];
  EXPECT_EQ(topology["kind"], "mask");
  EXPECT_GT(topology["mask_bytes"].get<int>(), 0);
  EXPECT_TRUE(topology["threshold"].is_null());
}

TEST_F(Vdb2Esvr, givesUpVoxelsOfTheMaskButNotTheirBox) {
  writeInput(in(), {{.voxels = ballInACloud()}});
  const SparseVolume source = readGrid(in(), "density").volume;
  for (const char* representation : {"ellipsoids", "voxels"}) {
    const auto run =
        vdb2esvr({in(), out(), "--force", "--psnr", "40", "--representation", representation});
    EXPECT_THAT(run.out, Not(HasSubstr("mask"))) << run.err;
    const SparseVolume back = decodeGrid(readEsvr(out()).grids[0]);
    EXPECT_EQ(activeBox(back), activeBox(source));
    EXPECT_LT(2 * activeVoxelCount(back), activeVoxelCount(source));
    EXPECT_GE(compareVolumes(source, back).psnrBox, 40.0);
  }
}

TEST_F(Vdb2Esvr, givesTheSameBytesInEveryRunOnAnyNumberOfThreads) {
  const std::string other = folder_ / "other.esvr";
  succeeded(fitQuickly("--threads 1"));
  for (const char* threads : {"1", "3"}) {
    succeeded(quickFit(in(), other, {"--threads", threads, "--force"}));
    EXPECT_EQ(readText(other), readText(out())) << threads << " threads";
  }
}

TEST_F(Vdb2Esvr, storesVoxelsForABound) {
  const std::string report = folder_ / "r.json";
  succeeded(vdb2esvr({in(), out(), "--max-error", "5%", "--report", report}));
  const Json made = Json::parse(readText(report))["grids"][0]["representation"];
  EXPECT_EQ(made["stored"], "voxels");
  EXPECT_TRUE(made["ellipsoids"].is_null());
  EXPECT_TRUE(readEsvr(out()).grids[0].voxels.has_value());
  EXPECT_THAT(
      vdb2esvr({in(), out(), "--force", "--max-error", "5%", "--representation", "ellipsoids"}),
      Fails(2, "store voxels"));
}

TEST_F(Vdb2Esvr, keepsAnExistingFileUnlessForced) {
  writeText(out(), "precious");
  EXPECT_THAT(fitQuickly(), Fails(1, "--force"));
  EXPECT_EQ(readText(out()), "precious");
  succeeded(fitQuickly("--force"));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

TEST_F(Vdb2Esvr, refusesOutputsThatCannotBeWrittenBeforeAnyWork) {
  std::filesystem::create_directory(folder_ / "folder.esvr");
  for (const std::string name : {"none/out.esvr", "folder.esvr"})
    EXPECT_THAT(quickFit(in(), folder_ / name, "--force"), Fails(1, name)) << name;
  EXPECT_THAT(quickFit(in(), "/proc/out.esvr").err, HasSubstr("/proc/out.esvr"));
  EXPECT_THAT(quickFit(in(), folder_ / "out.vdb"), Fails(2, ".esvr"));
  EXPECT_THAT(folder_.names(), ElementsAre("folder.esvr", "in.vdb"));
}

TEST_F(Vdb2Esvr, refusesToWriteOverItsInput) {
  std::filesystem::create_hard_link(in(), out());
  EXPECT_THAT(fitQuickly("--force"), Fails(2, "one file"));
}

TEST_F(Vdb2Esvr, keepsTheFileWhereOnlyTheTableCannotBePrinted) {
  EXPECT_THAT(runShell(std::string(VDB2ESVR) + " " + in() + " " + out() +
                       " --iterations 10 --representation ellipsoids > /dev/full"),
              Fails(1, "standard output"));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
}

/// A fit of a minute, which is interrupted after its first message about progress.
class Interrupted : public Vdb2Esvr {
 protected:
  [[nodiscard]] ProgramRun interrupted(const Words& more = {}) const {
    writeInput(in(), {{.voxels = softBall({})},
                      {.name = "heat", .voxels = softBall({}, 2.0f)},
                      {.name = "copy", .voxels = softBall({})}});
    const Words fit{in(), out(), "--seconds", "60", "--representation", "ellipsoids", "-v"};
    return runInterrupted(VDB2ESVR, joined(fit, more), " left\n");
  }
};

TEST_F(Interrupted, writesTheBestSoFarAndEndsWithCodeOne) {
  EXPECT_THAT(interrupted(),
              Fails(1, "out.esvr has the best result so far, without grid \"heat\""));
  EXPECT_THAT(checkEsvr(out()), IsEmpty());
  EXPECT_THAT(folder_.names(), ElementsAre("in.vdb", "out.esvr"));
}

TEST_F(Interrupted, reportsTheBestSoFar) {
  const auto run = interrupted({"--report", at("r.json")});
  EXPECT_THAT(run, Fails(1, "out.esvr has the best result so far"));
  EXPECT_THAT(run.out, HasSubstr("density"));  // the summary
  const auto report = Json::parse(readText(at("r.json")));
  EXPECT_EQ(report["interrupted"], true);
  EXPECT_EQ(report["exit_code"], 1);
  EXPECT_EQ(report["output"]["bytes"], std::filesystem::file_size(out()));
}

TEST_F(Vdb2Esvr, SlowEndsWithinTwoSecondsOfASignal) {
  // A million active voxels, for which a search for a size takes many seconds.
  const std::string large = folder_ / "large.vdb";
  succeeded(runProgram(ESVR_SAMPLE, {"plume", large, "--resolution", "256"}));
  for (const int signal : {SIGINT, SIGTERM})
    for (const double after : {0.3, 1.0, 2.0, 4.0}) {
      RunningProgram program(VDB2ESVR,
                             {large, out(), "--force", "--size", "60KB", "--device", "cpu"});
      std::this_thread::sleep_for(std::chrono::duration<double>(after));
      ASSERT_TRUE(program.runs());
      const auto start = std::chrono::steady_clock::now();
      program.send(signal);
      const auto run = program.wait();
      const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
      std::cout << "signal " << signal << " after " << after << " s: " << seconds.count() << " s, "
                << run.err;
      EXPECT_LT(seconds.count(), 2.0);
      EXPECT_THAT(run, Fails(1, "interrupted"));
      if (!std::filesystem::exists(out())) continue;
      EXPECT_THAT(checkEsvr(out()), IsEmpty());
      EXPECT_LE(std::filesystem::file_size(out()), 60'000u);
      std::filesystem::remove(out());
    }
}

struct BadFile {
  const char* name;
  std::function<void(const std::string& path)> make;
  const char* words;
};
std::ostream& operator<<(std::ostream& out, const BadFile& file) { return out << file.name; }

class BadInputFile : public testing::TestWithParam<BadFile> {};

TEST_P(BadInputFile, isRefusedByNameWithCodeThreeAndNothingIsWritten) {
  const TemporaryFolder folder;
  const std::string in = folder / "in.vdb";
  GetParam().make(in);
  const auto run = quickFit(in, folder / "out.esvr");
  EXPECT_THAT(run, Fails(3, "in.vdb", GetParam().words));
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
  writeInput(path, {{.voxels = softBall({})}});
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadInputFile,
    testing::Values(
        BadFile{"missing", [](const std::string&) {}, "no such file"},
        BadFile{"directory", [](const auto& path) { std::filesystem::create_directory(path); },
                "is a directory"},
        BadFile{"empty", [](const auto& path) { writeText(path, ""); }, "is empty"},
        BadFile{"text", [](const auto& path) { writeText(path, "density 1 2 3\n"); },
                "neither an OpenVDB nor a NanoVDB"},
        BadFile{"truncated", truncated, "in.vdb"},
        BadFile{"not finite", [](const auto& path) { writeInput(path, {withNonFinite()}); },
                "2 voxels are NaN, infinite or too large for float; the first is at (1, 2, 3)"}));

TEST_F(Vdb2Esvr, listsTheGridsWhereTheOneAskedForIsNotThere) {
  writeInput(in(), {{.name = "a", .voxels = softBall({})}, {.name = "b"}});
  EXPECT_THAT(fitQuickly("-g c"), Fails(3, "no grid \"c\"", "\"a\"", "\"b\""));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Vdb2Esvr, carriesGridsOfOtherTypesAndEmptyOnes) {
  writeMixedInput(in(), {{.voxels = softBall({})}, {.name = "none"}});
  const auto run = succeeded(fitQuickly());
  for (const char* type : {"bool", "int32", "vec3s", "ptdataidx32", "no active voxel"})
    EXPECT_THAT(run.out, HasSubstr(type));
  const EsvrFile file = readEsvr(out());
  EXPECT_EQ(file.grids.size(), 1u);
  EXPECT_EQ(file.carried.size(), 5u);
}

TEST_F(Vdb2Esvr, replacesNonFiniteVoxelsWhereAskedAndSaysHowMany) {
  writeInput(in(), {withNonFinite()});
  for (const auto& [option, words] : {std::pair{"zero", "by 0 (2 voxels)"},
                                      {"background", "by the background (2 voxels)"},
                                      {"0.25", "by 0.25 (2 voxels)"}})
    EXPECT_THAT(
        succeeded(vdb2esvr({in(), out(), "--force", "--lossless", "--nonfinite", option})).err,
        Says("NaN or infinite voxels were replaced", words));
  const SparseVolume decoded = decodeGrid(readEsvr(out()).grids.front());
  EXPECT_EQ(valueAt(decoded, {1, 2, 3}), 0.25f);
  std::filesystem::remove(out());
  EXPECT_THAT(fitQuickly("--nonfinite error"), Fails(3));
  for (const char* wrong : {"kept", "nan", "1e99", ""})
    EXPECT_THAT(fitQuickly({"--nonfinite", wrong}), Fails(2)) << wrong;
}

TEST_F(Vdb2Esvr, fitsTheGridsThatAreNamedOnly) {
  writeInput(in(), {{.voxels = softBall({})},
                    {.voxels = softBall({30, 0, 0})},
                    {.name = "heat", .voxels = softBall({})}});
  succeeded(fitQuickly("--grid heat -g density[1]"));
  const EsvrFile file = readEsvr(out());
  ASSERT_EQ(file.grids.size(), 2u);
  EXPECT_EQ(file.grids[0].activeBox.min.x, 26);
  EXPECT_EQ(file.grids[1].descriptor.name, "heat");
}

TEST_F(Vdb2Esvr, refusesWhatTakesMoreMemoryThanAllowed) {
  EXPECT_THAT(fitQuickly("--max-memory 100B"), Fails(5, "density"));
  EXPECT_FALSE(outIsThere());
}

/// A command line of a shell that runs vdb2esvr quickly.
std::string quickly(const std::string& input, const std::string& output) {
  return std::string(VDB2ESVR) + " " + input + " " + output + " --lossless -q";
}

TEST_F(Vdb2Esvr, readsAPipe) {
  succeeded(vdb2esvr({in(), out(), "--lossless"}));
  const std::string expected = readText(out());
  for (const std::string& line :
       {"cat " + in() + " | " + quickly("-", folder_ / "piped.esvr"),
        quickly("-", folder_ / "piped.esvr") + " < " + in(),
        "mkfifo " + std::string(folder_ / "pipe") + "; cat " + in() + " > " +
            std::string(folder_ / "pipe") + " & " + "sleep 0.2; " +
            quickly(folder_ / "pipe", folder_ / "piped.esvr")}) {
    const auto run = runShell(line);
    EXPECT_EQ(run.exitCode, 0) << line << run.err;
    EXPECT_EQ(readText(folder_ / "piped.esvr"), expected) << line;
    std::filesystem::remove(folder_ / "piped.esvr");
  }
  succeeded(
      runShell(std::string(ESVR2VDB) + " - " + std::string(folder_ / "back.vdb") + " < " + out()));
}

TEST_F(Vdb2Esvr, leavesNoCopyOfAPipeAndRefusesOtherBytes) {
  std::filesystem::create_directory(folder_ / "tmp");
  const std::string tmp = "TMPDIR=" + std::string(folder_ / "tmp") + " ";
  succeeded(runShell(tmp + quickly("-", out()) + " < " + in()));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "tmp"));
  EXPECT_THAT(runShell(tmp + quickly("-", folder_ / "x.esvr") + " < /dev/zero"),
              Fails(3, "standard input is neither"));
  EXPECT_THAT(vdb2esvr({"-", folder_ / "x.esvr"}), Fails(3)) << "an empty input";
  EXPECT_THAT(runShell("head -c 300 " + in() + " | " + tmp + quickly("-", folder_ / "x.esvr")),
              Fails(3, "vdb2esvr: standard input: "));
}

TEST_F(Vdb2Esvr, fitsNoMixtureOfAFileThatIsReplacedWhileItIsReadSlow) {
  const std::string other = folder_ / "other.vdb", next = folder_ / "next.vdb";
  writeInput(in(), {{.name = "a", .voxels = cloud(8)}, {.name = "b", .voxels = cloud(8)}});
  writeInput(other, {{.name = "a", .voxels = softBall({})}, {.name = "b", .voxels = softBall({})}});
  RunningProgram run(VDB2ESVR, {in(), out(), "--count", "60", "--iterations", "4000"});
  while (run.runs() && !run.handlesInterrupts()) {
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // it has read the list of grids
  std::filesystem::copy_file(other, next);
  std::filesystem::rename(next, in());
  EXPECT_THAT(run.wait(), Fails(3, "was replaced while it was read"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Vdb2Esvr, hasAMostNumberOfThreads) {
  EXPECT_THAT(fitQuickly("--threads 2147483647"), Fails(2));
  succeeded(fitQuickly("--threads 4096"));
}

TEST_F(Vdb2Esvr, overwritesNoInputThroughALink) {
  const std::string before = readText(in());
  std::filesystem::create_symlink(in(), folder_ / "report.json");
  EXPECT_THAT(fitQuickly({"--force", "--report", folder_ / "report.json"}),
              Fails(2, "are one file"));
  std::filesystem::copy_file(in(), folder_ / "f.1.vdb");
  std::filesystem::create_symlink(folder_ / "f.1.vdb", folder_ / "frames.json");
  std::filesystem::create_symlink(folder_ / "f.1.vdb", folder_ / "o.1.esvr");
  const auto report = vdb2esvr({folder_ / "f.@.vdb", folder_ / "new.@.esvr", "--force", "--report",
                                folder_ / "frames.json"});
  EXPECT_THAT(report, Fails(2));
  const auto frames = vdb2esvr({folder_ / "f.@.vdb", folder_ / "o.@.esvr", "--force"});
  EXPECT_THAT(frames, Fails(2));
  EXPECT_EQ(readText(in()), before);
  EXPECT_EQ(readText(folder_ / "f.1.vdb"), before);
}

TEST_F(Vdb2Esvr, writesNoMessageIntoAFileIfStandardErrorIsClosed) {
  std::filesystem::copy_file(in(), folder_ / "f.1.vdb");
  std::filesystem::copy_file(in(), folder_ / "f.2.vdb");
  const std::string command = std::string(VDB2ESVR) + " '" + std::string(folder_ / "f.@.vdb") +
                              "' " + out() + " --lossless";
  succeeded(runShell(command + " -q"));
  const std::string expected = readText(out());
  for (const char* closed : {" 2>&-", " >&- 2>&- <&-"}) {
    (void)runShell(command + " --force -v" + closed);
    EXPECT_EQ(readText(out()), expected) << closed;
  }
}

class RefusedOptions : public Vdb2Esvr, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedOptions, areNamedAndLeaveNoFile) {
  GetParam().expectOf(vdb2esvr(joined({in(), out()}, GetParam().arguments)));
  EXPECT_FALSE(outIsThere());
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedOptions,
    testing::Values(
        Refusal{"--size 5XB", 2, "--size"}, Refusal{"--size 9KB --psnr 40", 2, "--psnr"},
        Refusal{"--size 9KB --ratio 9", 2, "--ratio"}, Refusal{"--ratio 0.5", 2, "--ratio"},
        Refusal{"--max-error 0", 2, "--max-error"}, Refusal{"--max-error 1x", 2, "--max-error"},
        Refusal{"--representation voxels --count 9", 2, "--count"},
        Refusal{"--representation cubes", 2, "cubes"},
        Refusal{"--representation ellipsoids --lossless", 2, "--lossless"},
        Refusal{
            {"--representation", "voxels", "--psnr", "40", "--storage", "float32"}, 2, "float32"},
        Refusal{"--lossless --psnr 40", 2, "--psnr"}, Refusal{"--size 99", 2, "bytes"},
        Refusal{"--count 0", 2, "--count"}, Refusal{"--count x", 2, "x"},
        Refusal{"--psnr -1", 2, "--psnr"}, Refusal{"--psnr nan", 2, "psnr"},
        Refusal{"--seconds 0", 2, "--seconds"}, Refusal{"--iterations 0", 2, "--iterations"},
        Refusal{"--preset best", 2, "best"}, Refusal{"--box 1,2,3", 2, "--box"},
        Refusal{"--box 5,5,5,1,1,1", 2, "no voxel"},
        Refusal{"--max-error 1% --paper epochs=9", 2, "--paper"},
        Refusal{"--max-error 1% --preset paper --iterations 9", 2, "paper"},
        Refusal{"--lossless --max-error 1%", 2, "--max-error"},
        Refusal{"--share density", 2, "--share"},
        Refusal{"--paper default --iterations 9", 2, "--iterations"},
        Refusal{"--paper default --preset high", 2, "--preset"},
        Refusal{"--paper default --size 9KB", 2, "--paper"},
        Refusal{"--paper sharpness=3", 2, "no key 'sharpness'"},
        Refusal{"--paper k", 2, "KEY=VALUE"}, Refusal{"--paper k=soft", 2, "soft"},
        Refusal{"--paper k=3,k=4", 2, "twice"}, Refusal{"--paper beta=2", 2, "beta"},
        Refusal{"--paper epochs=0", 2, "epochs"}, Refusal{"--paper rates=1:2:3", 2, "four rates"},
        Refusal{"--paper k=learned --storage compact", 2, "edge"},
        Refusal{"--paper kernel=gaussian,k=3", 2, "Gaussians"},
        Refusal{"--paper prunes=2", 2, "prunes"}, Refusal{"--paper prune-score=best", 2, "best"},
        Refusal{"--device tpu", 2, "tpu"}, Refusal{"--device cuda:4096", 5, "cuda:4096"},
        Refusal{"--report report.txt", 2, ".json"}, Refusal{"more", 2, "unexpected argument"}));

}  // namespace
}  // namespace esvr::test
