// Plan: these tests cover the options of vdb2esvr, esvr2vdb and esvr-compare whose effect no other test
// shows. Each test compares the output with and without an option.
//
// The options that all programs share are tested with every program. The messages of the
// dynamic linker (LD_DEBUG=files, ld.so(8)) name every library that a command loads or looks for.
// Commands that need no device must not look for CUDA's driver; a conversion on a GPU must, which
// shows that the messages are complete.

#include <algorithm>
#include <cstdlib>
#include <regex>
#include <sstream>
#include <string_view>

#include "cli/conversion.h"
#include "esvr/container.h"
#include "esvr/device.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

class Vdb2EsvrOption : public FolderTest {
 protected:
  void SetUp() override { writeInput(at("in.vdb"), {{.voxels = cloud(8)}}); }
  /// Converts to NAME and returns the report.
  [[nodiscard]] Json convert(const Words& options, const std::string& name = "out.esvr") const {
    const auto run =
        succeeded(vdb2esvr(joined({at("in.vdb"), at(name), "--force", "--report", "-"}, options)));
    return Json::parse(run.out, nullptr, false);
  }
  /// Makes a fit that takes milliseconds, and returns the report of its grid.
  [[nodiscard]] Json quick(Words options, const std::string& name = "out.esvr") const {
    options.insert(options.end(), {"--iterations", "60", "--device", "cpu"});
    if (std::ranges::count(options, "--representation") == 0)
      options.insert(options.end(), {"--representation", "ellipsoids"});
    return convert(options, name)["grids"][0];
  }
};

TEST_F(Vdb2EsvrOption, countIsTheNumberOfEllipsoids) {
  EXPECT_EQ(quick("--count 7")["ellipsoids"], 7);
  EXPECT_EQ(quick("--count 12")["ellipsoids"], 12);
}

TEST_F(Vdb2EsvrOption, iterationsEndTheFit) {
  const Json grid = convert("--count 5 --iterations 33 --representation ellipsoids")["grids"][0];
  EXPECT_EQ(grid["curve"].back()["iteration"], 33);
}

TEST_F(Vdb2EsvrOption, effortLengthensTheFit) {
  const auto iterations = [&](const char* effort) {
    const Json grid =
        convert({"--count", "5", "--effort", effort, "--representation", "ellipsoids"})["grids"][0];
    return grid["curve"].back()["iteration"].get<int>();
  };
  EXPECT_LT(iterations("1"), iterations("5"));
  EXPECT_LT(iterations("5"), iterations("7"));
}

TEST_F(Vdb2EsvrOption, picturePsnrIsReached) {
  const Json coarse = quick("--picture-psnr 25"), fine = quick("--picture-psnr 40");
  EXPECT_EQ(fine["measured"], "pictures");
  EXPECT_GE(coarse["quality"]["psnr_t50"].get<double>(), 25.0);
  EXPECT_GE(fine["quality"]["psnr_t50"].get<double>(), 40.0);
  EXPECT_LT(coarse["bytes"].get<int>(), fine["bytes"].get<int>());
}

TEST_F(Vdb2EsvrOption, maxRelativeErrorHoldsAtEveryVoxel) {
  const auto bytes = [&](const char* bound) {
    return convert({"--max-relative-error", bound})["grids"][0]["bytes"].get<int>();
  };
  const int fine = bytes("1%"), coarse = bytes("10%");
  EXPECT_LT(coarse, fine);
  EXPECT_LT(bytes("1%,0.5"), fine);
  succeeded(compare("check", {at("in.vdb"), at("out.esvr"), "--max-relative-error", "1%,0.5"}));
  for (const char* text : {"0", "100%", "1%,0", "1%,x", "1%,1,2", "1e400"})
    EXPECT_THAT(vdb2esvr({at("in.vdb"), at("no.esvr"), "--max-relative-error", text}), Fails(2))
        << text;
}

TEST_F(Vdb2EsvrOption, measureSaysWhatAPresetMeans) {
  const auto measured = [&](const char* measure) -> Json {
    return convert({"--measure", measure, "--representation", "ellipsoids"})["grids"][0];
  };
  const Json seen = measured("auto"), values = measured("values");
  EXPECT_EQ(seen["measured"], "pictures");
  EXPECT_EQ(values["measured"], "values");
  EXPECT_GE(seen["quality"]["psnr_t50"].get<double>(), 38.0);
  EXPECT_GE(values["metrics"]["psnr_active"].get<double>(), 40.0);
}

TEST_F(Vdb2EsvrOption, toneIsStored) {
  EXPECT_EQ(quick("--tone 0.125")["tone"].get<float>(), 0.125f);
  EXPECT_EQ(readEsvr(at("out.esvr")).grids[0].tone.scale, 0.125f);
  EXPECT_TRUE(quick("--tone off")["tone"].is_null());
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
  const auto reaching = [&](const char* psnr) { return quick({"--psnr", psnr}); };
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
  const Json chosen = quick("--psnr 60 --representation auto")["representation"];
  const std::string other = chosen["stored"] == "voxels" ? "ellipsoids" : "voxels";
  EXPECT_LE(chosen[chosen["stored"].get<std::string>()]["bytes"], chosen[other]["bytes"]);
}

TEST_F(Vdb2EsvrOption, secondsEndTheFit) {
  const Json grid = convert("--count 20 --iterations 10000000 --seconds 0.2")["grids"][0];
  EXPECT_EQ(grid["fit"]["end"], "time up");
}

TEST_F(Vdb2EsvrOption, chunkVoxelsDivideTheFit) {
  const Json one = quick("--count 40"), several = quick("--count 40 --chunk-voxels 600");
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
  const Json metrics = quick("--count 5 --box -20,-20,-20,20,20,19")["metrics"];
  EXPECT_EQ(metrics["box_voxels"], 41.0 * 41.0 * 40.0);
}

TEST_F(Vdb2EsvrOption, seedsGiveOtherFiles) {
  const auto bytes = [&](const char* seed) {
    (void)quick({"--count", "9", "--seed", seed});
    return readText(at("out.esvr"));
  };
  const std::string first = bytes("1");
  EXPECT_NE(bytes("2"), first);
  EXPECT_EQ(bytes("1"), first);
}

TEST_F(Vdb2EsvrOption, storageIsCompactOrFloat32) {
  const Json compact = quick("--count 40"), floats = quick("--count 40 --storage float32");
  EXPECT_TRUE(compact["compact"].is_object());
  EXPECT_TRUE(floats["compact"].is_null());
  EXPECT_LT(compact["bytes"].get<int>(), floats["bytes"].get<int>());
}

TEST_F(Vdb2EsvrOption, devicesAreTakenAsNamed) {
  EXPECT_EQ(quick("--count 5")["fit"]["device"], "CPU");
}

TEST_F(Vdb2EsvrOption, maxVramBoundsTheDevicesMemoryOnGpu) {
  Device gpu;
  selectOrSkip("cuda", gpu);
  if (IsSkipped()) return;
  const Words onGpu{"--device", "cuda", "--max-vram"};
  const auto convert = [&](const char* input, Words options) {
    options.insert(options.begin(), onGpu.begin(), onGpu.end());
    return vdb2esvr(joined({at(input), at("out.esvr"), "--report", at("out.json")}, options));
  };
  // The bricks of the large cloud take more than 1 MB; all ellipsoids of the small one more than 3.
  writeInput(at("large.vdb"), {{.voxels = cloud(24)}});
  writeInput(at("small.vdb"), {{.voxels = cloud(12)}});
  EXPECT_THAT(convert("large.vdb", "0.001"), Fails(5));
  EXPECT_THAT(succeeded(convert("small.vdb", "0.003 --count 5000 --iterations 50 -f")).err,
              Says("GPU was full", "instead of 5000"));
  const Json fit = Json::parse(readText(at("out.json")))["grids"][0]["fit"];
  EXPECT_EQ(fit["device_full"], true);
  EXPECT_EQ(fit["wanted"], 5000);
}

class Esvr2VdbOption : public FolderTest {
 protected:
  /// A cube of 16^3 equal voxels, stored losslessly, which a tree can hold as tiles.
  void SetUp() override {
    std::vector<InputVoxel> cube;
    for (int v = 0; v < 4096; ++v) cube.push_back({{v / 256, v / 16 % 16, v % 16}, 1.0f});
    writeInput(at("in.vdb"), {{.voxels = cube}});
    succeeded(vdb2esvr({at("in.vdb"), at("in.esvr"), "--lossless"}));
  }
  [[nodiscard]] ProgramRun decode(const std::string& name, const Words& more) const {
    const auto run = succeeded(esvr2vdb(joined({at("in.esvr"), at(name)}, more)));
    return run;
  }
};

TEST_F(Esvr2VdbOption, noTilesWritesLeaves) {
  constexpr int kSide = 72;  // small grids keep their leaves for Blender
  std::vector<InputVoxel> cube;
  for (int v = 0; v < kSide * kSide * kSide; ++v)
    cube.push_back({{v / (kSide * kSide), v / kSide % kSide, v % kSide}, 1.0f});
  writeInput(at("in.vdb"), {{.voxels = cube}});
  succeeded(vdb2esvr({at("in.vdb"), at("in.esvr"), "--lossless", "--force"}));
  (void)decode("tiles.vdb", {});
  (void)decode("leaves.vdb", "--no-tiles");
  EXPECT_GT(sizeOf("leaves.vdb"), sizeOf("tiles.vdb"));
  EXPECT_EQ(readGrid(at("leaves.vdb"), "density").volume.values,
            readGrid(at("tiles.vdb"), "density").volume.values);
}

TEST_F(Esvr2VdbOption, boxIsWherePsnrIsTaken) {
  succeeded(quickFit(at("in.vdb"), at("in.esvr"), "--force"));
  const Words compared{"--reference", at("in.vdb")};
  const auto usual = decode("a.vdb", compared);
  const auto larger = decode("b.vdb", {"--reference", at("in.vdb"), "--box", "0,0,0,99,99,99"});
  EXPECT_NE(usual.out, larger.out);
}

class CompareOption : public FolderTest {
 protected:
  void SetUp() override {
    auto off = softBall({});
    for (auto& voxel : off) voxel.value += 0.01f;
    writeInput(at("ref.vdb"), {{.voxels = softBall({})}, {.name = "heat", .voxels = off}});
    writeInput(at("off.vdb"), {{.voxels = off}, {.name = "heat", .voxels = off}});
    succeeded(quickFit(at("ref.vdb"), at("fit.esvr")));
  }
  [[nodiscard]] Json run(const std::string& job, const Words& arguments) const {
    const auto ran = succeeded(compare(job, joined(arguments, "--report -")));
    return Json::parse(ran.out, nullptr, false);
  }
  [[nodiscard]] Json check(const Words& more) const {
    return run("check", joined({at("ref.vdb"), at("off.vdb")}, more));
  }
  [[nodiscard]] Json table(Words more) const {
    if (std::ranges::count(more, "--row") == 0) more.insert(more.end(), {"--rows", "none"});
    return run("table", joined({at("ref.vdb"), at("fit.esvr"), "--runs", "1"}, more))["rows"][0];
  }
};

TEST_F(CompareOption, checkTakesTheGridTheBoxAndThePeak) {
  EXPECT_EQ(check({})["grids"].size(), 2u);
  EXPECT_EQ(check("--grid heat")["grids"].size(), 1u);
  const auto psnr = [&](const Words& more) {
    return check(joined(more, "--grid density"))["grids"][0]["psnr_box"].get<double>();
  };
  const double usual = psnr({});
  EXPECT_NEAR(psnr({"--peak", "10"}), usual + 20.0, 1e-6) << "ten times the peak";
  EXPECT_GT(psnr({"--box", "-40,-40,-40,40,40,40"}), usual) << "more voxels without error";
}

TEST_F(CompareOption, reportsAreReplacedWhereForced) {
  const Words usual{"check", at("ref.vdb"), at("off.vdb"), "--report", at("r.json")};
  auto forced = usual;
  forced.emplace_back("--force");
  writeText(at("r.json"), "old");
  EXPECT_THAT(runProgram(ESVR_COMPARE, usual), Fails(1));
  EXPECT_EQ(readText(at("r.json")), "old");
  succeeded(runProgram(ESVR_COMPARE, forced));
  EXPECT_THAT(readText(at("r.json")), HasSubstr("esvr-check"));
}

TEST_F(CompareOption, tableTakesTheGridTheBoxAndThePeak) {
  const Json usual = table({}), peak = table("--peak 10");
  EXPECT_NEAR(peak["psnr_box"].get<double>(), usual["psnr_box"].get<double>() + 20.0, 1e-6);
  EXPECT_NE(table("--grid heat")["psnr_box"], usual["psnr_box"]);
  EXPECT_GT(table("--box -40,-40,-40,40,40,40")["psnr_box"].get<double>(),
            usual["psnr_box"].get<double>());
}

TEST_F(CompareOption, tablesPicturesTakeStepAndTransferFunctions) {
  const Words pictures{"--images", "1", "--image-size", "24", "--device", "cpu"};
  const auto psnr = [&](const Words& more) {
    return table(joined(more, pictures))["image_psnr"].get<double>();
  };
  writeText(at("tf.json"),
            R"([{"Name": "Red", "RGBPoints": [0, 1, 0, 0, 1, 1, 0.5, 0],
                      "Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}])");
  const double usual = psnr({});
  EXPECT_NE(psnr({"--image-step", "3"}), usual);
  EXPECT_NE(psnr({"--tf", at("tf.json")}), usual);
}

TEST_F(CompareOption, tablesAreReplacedWhereForced) {
  writeText(at("t.csv"), "old");
  const Words usual{"table",  at("ref.vdb"), at("fit.esvr"), "--rows",   "none",
                    "--runs", "1",           "--csv",        at("t.csv")};
  auto forced = usual;
  forced.emplace_back("--force");
  EXPECT_THAT(runProgram(ESVR_COMPARE, usual), Fails(1));
  EXPECT_EQ(readText(at("t.csv")), "old");
  succeeded(runProgram(ESVR_COMPARE, forced));
  EXPECT_THAT(readText(at("t.csv")), HasSubstr("fit.esvr"));
}

// ---- Every program

using testing::IsEmpty;
using testing::Not;

struct ProgramCommand {
  const char* name;
  const char* path;
  Words arguments;  ///< arguments of a run of milliseconds; "DIR/x" is in the test's folder
};
std::ostream& operator<<(std::ostream& out, const ProgramCommand& program) {
  return out << program.name;
}

/// The lines that a program printed, without numbers, which may be times as short as 1e-05 seconds,
/// and without the spaces and dashes of tables, whose widths depend on them.
Words linesOf(const ProgramRun& run) {
  static const std::regex numbers("[0-9][0-9.]*(e[-+][0-9]+)?");
  std::string text = std::regex_replace(run.out + run.err, numbers, "");
  std::erase_if(text,
                [](char c) { return std::string_view(" .-").find(c) != std::string_view::npos; });
  Words lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

class EveryProgram : public FittedBall, public testing::WithParamInterface<ProgramCommand> {
 protected:
  [[nodiscard]] ProgramRun run(const Words& more) const {
    Words arguments = GetParam().arguments;
    for (auto& argument : arguments)
      if (argument.starts_with("DIR/")) argument = at(argument.substr(4));
    const auto result = succeeded(runProgram(GetParam().path, joined(arguments, more)));
    return result;
  }
  /// The command of a program that has several.
  [[nodiscard]] Words job() const {
    if (std::string(GetParam().path) != ESVR_COMPARE) return {};
    return {GetParam().arguments[0]};
  }
};

TEST_P(EveryProgram, helpAndVersionNeedNoFiles) {
  Words job = this->job();
  for (const char* option : {"--help", "-h"}) {
    auto arguments = job;
    arguments.emplace_back(option);
    EXPECT_THAT(runProgram(GetParam().path, arguments).out, Says("Usage:", "--version"));
  }
  job.emplace_back("--version");
  EXPECT_THAT(runProgram(GetParam().path, job).out, Says("0.", "OpenVDB"));
}

TEST_P(EveryProgram, helpFitsOnTwoScreens) {
  constexpr std::ptrdiff_t kTwoScreens = 100;  // lines
  Words arguments = job();
  arguments.emplace_back("--help");
  const std::string help = runProgram(GetParam().path, arguments).out;
  EXPECT_LE(std::ranges::count(help, '\n'), kTwoScreens);
}

TEST_P(EveryProgram, saysNothingWhereQuietAndMoreWhereVerbose) {
  const auto quiet = run("--quiet"), usual = run({}), verbose = run("--verbose");
  EXPECT_THAT(quiet.out + quiet.err, IsEmpty());
  EXPECT_THAT(linesOf(verbose), testing::IsSupersetOf(linesOf(usual)));
}

TEST_P(EveryProgram, takesANumberOfThreads) {
  (void)run("--threads 1");
  auto arguments = GetParam().arguments;
  EXPECT_THAT(runProgram(GetParam().path, joined(arguments, "--threads 0")), Fails(2, "threads"));
}

TEST_P(EveryProgram, saysWhichOptionAMistypedOneMayBe) {
  auto arguments = job();
  EXPECT_THAT(runProgram(GetParam().path, joined(arguments, "--thraeds 1")),
              Fails(2, "--thraeds", "; did you mean --threads?\n"));
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
                        {"table", "DIR/in.vdb", "DIR/in.esvr", "--rows", "none", "--runs", "1"}}),
    [](const auto& tested) { return std::string(tested.param.name); });

constexpr const char* kDriver = "libcuda.so";

class Start : public FittedBall {
 protected:
  /// What the dynamic linker says about a run.
  static std::string librariesOf(const char* program, const Words& arguments) {
    ::setenv("LD_DEBUG", "files", 1);
    const auto run = runProgram(program, arguments);
    ::unsetenv("LD_DEBUG");
    EXPECT_THAT(run.err, HasSubstr("libstdc++")) << "the linker says nothing";
    return run.err;
  }
};

TEST_F(Start, doesNotLookForADriverWithoutADevice) {
  for (const char* job : {"--list", "--check"})
    EXPECT_THAT(librariesOf(ESVR2VDB, {job, at("in.esvr")}), Not(HasSubstr(kDriver))) << job;
  EXPECT_THAT(librariesOf(ESVR2VDB, {"--list", at("in.vdb")}), Not(HasSubstr(kDriver)));
  EXPECT_THAT(librariesOf(ESVR2VDB, {at("in.esvr"), at("back.vdb")}), Not(HasSubstr(kDriver)));
  EXPECT_THAT(librariesOf(VDB2ESVR, {at("in.vdb"), at("o.esvr"), "--lossless", "--device", "cpu"}),
              Not(HasSubstr(kDriver)));
}

TEST_F(Start, doesNotLookForADriverForHelp) {
  for (const char* program : {VDB2ESVR, ESVR2VDB, ESVR_RENDER, ESVR_VIEW, ESVR_COMPARE})
    EXPECT_THAT(librariesOf(program, "--help"), Not(HasSubstr(kDriver))) << program;
}

TEST_F(Start, looksForADriverOnlyIfTheBuildHasCuda) {
  const auto libraries =
      librariesOf(VDB2ESVR, {at("in.vdb"), at("o.esvr"), "--lossless", "--device", "cuda"});
  EXPECT_EQ(libraries.find(kDriver) != std::string::npos, builtWithCuda());
}

}  // namespace

}  // namespace esvr::test
