// Plan: files whose grids share names, look numbered or look like components go through all
// programs, and each grid keeps its own value under the same name. The components of vectors come
// back with everything of the source, and are one grid for the summary, the reports and the lists.
//
// Grids of one file that are alike take fewer bytes together than apart, at the quality that was
// asked for, and grids with the same voxels are stored once. Each can be read back without the others.
// What is shared and when is tested in tests/encode/convert_file_test.cpp.

#include <openvdb/io/File.h>

#include <limits>

#include "cli/conversion.h"
#include "fit/volumes.h"
#include "vdb/open_vdb.h"

namespace esvr::test {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

using Values = std::vector<float>;

class NamedGrids : public Conversion {
 protected:
  /// Writes grids of one voxel, whose values are 1, 2, ...
  void write(const Words& names) const {
    std::vector<InputGrid> grids;
    for (const auto& name : names)
      grids.push_back({.name = name, .voxels = {{{0, 0, 0}, float(grids.size() + 1)}}});
    writeInput(in(), grids);
  }

  [[nodiscard]] Values valuesIn(const std::string& file) const {
    Values values;
    for (std::size_t g = 0; g < inspectVdb(at(file)).grids.size(); ++g)
      values.push_back(activeRange(readGrid(at(file), g).volume).max);
    return values;
  }
};

TEST_F(NamedGrids, KeepTheirValuesWhateverTheyAreCalled) {
  for (const Words& names : {Words{"a", "a", "a[1]"},
                             {"a[0]", "a", "a"},
                             {"", "", "[0]"},
                             {"a[0]", "a[1]", "a", "a"},
                             {"(unnamed)", ""},
                             {"a#2", "a", "a"}}) {
    write(names);
    Values expected;
    for (std::size_t g = 0; g < names.size(); ++g) expected.push_back(float(g + 1));
    ASSERT_EQ(valuesIn("in.vdb"), expected);
    for (const char* share : {"auto", "off"}) {
      thereAndBack({"--lossless", "--share", share});
      EXPECT_EQ(valuesIn("back.vdb"), expected) << names.front() << " " << share;
    }
    succeeded(check(out(), "--max-error 0"));
  }
}

TEST_F(NamedGrids, AreFoundByTheSameNamesInBothFiles) {
  write("a a a[1]");
  thereAndBack("--lossless");
  EXPECT_THAT(esvr2vdb({"--list", out()}).out, Says("a[0] ", "a#2 ", "a[1] "));
  const EsvrFile file = readEsvr(out());
  for (const auto& [name, value] : {std::pair("a[0]", 1.0f), {"a#2", 2.0f}, {"a[1]", 3.0f}}) {
    EXPECT_EQ(readGrid(in(), name).volume.values[0], value);
    EXPECT_EQ(decodeGrid(file.grids[findStored(file, name)]).values[0], value);
    const auto run =
        succeeded(esvr2vdb({out(), at("one.vdb"), "-g", name, "--force", "--reference", in()}));
    EXPECT_EQ(valuesIn("one.vdb"), Values{value});
    EXPECT_THAT(run.out, HasSubstr("exact")) << name;
  }
}

TEST_F(NamedGrids, AreToldWhereANameIsAmbiguous) {
  write("a a b");
  EXPECT_THAT(vdb2esvr({in(), out(), "-g", "a"}),
              Fails(3, "has 2 grids \"a\"", "\"a[0]\" (grid 1 of the file), \"a[1]\" (grid 2"));
  succeeded(vdb2esvr({in(), out(), "-g", "a[1]"}));
}

/// Texts of the library, of which some know the name in the file only, are about one grid, too.
TEST_F(NamedGrids, AreToldByTheNamesThatFindThem) {
  const std::vector<InputVoxel> far{{{100, 0, 0}, 1e38f}};
  writeInput(in(), {{.name = "a", .voxels = softBall({})},
                    {.name = "a", .voxels = far},
                    {.name = "a", .voxels = softBall({}), .map = InputMap::kFrustum}});
  EXPECT_THAT(vdb2esvr({in(), out(), "--representation", "ellipsoids"}), Fails(3, "'a[1]'"));
  succeeded(vdb2esvr({in(), out(), "--lossless"}));
  const std::string back = at("back.vdb");
  EXPECT_THAT(succeeded(esvr2vdb({out(), back, "--bbox", "-2,-2,-2,2,2,2"})).err,
              HasSubstr("grid \"a[1]\" comes back without an active voxel"));
  EXPECT_THAT(esvr2vdb({out(), back, "-f", "--coarsen", "2"}), Fails(2, "'a[2]'"));
  EXPECT_THAT(esvr2vdb({out(), back, "-f", "--half", "on"}), Fails(2, "\"a[1]\""));
  EXPECT_THAT(esvr2vdb({out(), at("back.nvdb")}), Fails(2, "\"a[2]\""));
}

TEST_F(NamedGrids, AreComparedWithThoseThatTheyComeFromAfterOthersWereLeftOut) {
  write("a a a");
  thereAndBack("--lossless --skip a[0]");
  EXPECT_THAT(check(out()),
              Fails(4, "\"a[0]\" is missing", Not(HasSubstr("\"a[1]\"")),
                    Not(HasSubstr("\"a[2]\"")), Not(HasSubstr("not in the reference"))));
  succeeded(check(out(), "--ignore-grids a[0] --max-error 0"));
  succeeded(check(out(), "-g a[2] --max-error 0"));
}

TEST_F(NamedGrids, WinOverComponentsOfTheirName) {
  writeVectorInput(in(), {.name = "vel", .voxels = softBall({})},
                   {{.name = "vel.x", .voxels = {{{0, 0, 0}, 7.0f}}}});
  thereAndBack("--lossless --representation voxels");
  const EsvrFile file = readEsvr(out());
  EXPECT_EQ(activeRange(readGrid(in(), "vel.x").volume).max, 7.0f);
  ASSERT_EQ(file.vectors.size(), 1u);
  EXPECT_EQ(file.grids[findStored(file, "vel.x")].valueMax, 7.0f);
  EXPECT_EQ(findStored(file, "vel[0].x"), 0u);
  EXPECT_EQ(findStored(file, "vel.y"), 1u);
  const auto run = succeeded(check(out()));
  EXPECT_EQ(run.out.find("vel.x "), run.out.rfind("vel.x ")) << run.out;
}

TEST_F(NamedGrids, WithoutANameAreShownAsSuch) {
  write({""});
  EXPECT_THAT(succeeded(vdb2esvr({in(), out(), "--keep", ""})).out,
              HasSubstr("(unnamed): carried unchanged"));
  EXPECT_THAT(esvr2vdb({"--list", "-v", out()}).out, Not(HasSubstr("\n:")));
}

TEST_F(NamedGrids, CannotControlTheTerminal) {
  const std::string name = "a\x1b[2J\xc2\x9b\n\xe2\x80\xae";
  write({name, "b"});
  const std::vector<ProgramRun> runs{vdb2esvr({in(), out(), "-v", "--report", "-"}),
                                     vdb2esvr({in(), at("two.esvr"), "-g", "c"}),
                                     esvr2vdb({"--list", "-v", out()}),
                                     esvr2vdb({"--list", "-v", in()}),
                                     esvr2vdb({out(), at("x.vdb"), "-g", "c"}),
                                     check(out(), "-g b"),
                                     check(out(), "--min-psnr 500")};
  for (const auto& run : runs)
    for (const std::string& text : {run.out, run.err})
      for (const char* part : {"\x1b", "\xc2\x9b", "\xe2\x80\xae", "a?[2J?\n"})
        EXPECT_THAT(text, Not(HasSubstr(part)));
  EXPECT_THAT(runs[3].out, HasSubstr("a?[2J???"));
  thereAndBack("--lossless");
  EXPECT_EQ(inspectVdb(back()).grids[0].name, name);
}

TEST_F(NamedGrids, MayBeMissingInAFileAltogether) {
  writeInput(in(), {});
  thereAndBack();
  EXPECT_TRUE(inspectVdb(back()).grids.empty());
  EXPECT_EQ(stringValue(inspectVdb(back()).metadata, "creator"), kInputCreator);
  for (const char* file : {"in.vdb", "out.esvr"})
    EXPECT_THAT(succeeded(esvr2vdb({"--list", at(file)})).out, HasSubstr("bytes, no grid"));
  EXPECT_THAT(succeeded(check(out())).out, HasSubstr("no grid in either file"));
  EXPECT_THAT(esvr2vdb({out(), at("x.nvdb")}),
              Fails(3, "has no grid, and a .nvdb file cannot be without one"));
  EXPECT_FALSE(std::filesystem::exists(at("x.nvdb")));
  EXPECT_THAT(vdb2esvr({in(), at("y.esvr"), "-g", "density"}), Fails(3));
  EXPECT_THAT(runProgram(ESVR_RENDER, {out(), at("x.png")}), Fails(3, "no grid"));
}

TEST_F(NamedGrids, MayBeMissingInTheFirstFrame) {
  writeInput(at("s.0001.vdb"), {});
  for (const char* frame : {"s.0002.vdb", "s.0003.vdb"})
    writeInput(at(frame), {{.voxels = softBall({})}});
  for (const char* output : {"t.####.esvr", "all.esvr"}) {
    succeeded(vdb2esvr({at("s.####.vdb"), at(output), "-g", "density", "--ratio", "2", "--report",
                        at(std::string("r") + output[0] + ".json")}));
    succeeded(esvr2vdb({at(output), at(std::string("b") + output[0] + ".####.vdb")}));
    EXPECT_THAT(succeeded(compare("check", {at("s.####.vdb"), at(output)})).out,
                HasSubstr("frame 1: no grid in either file"));
  }
  for (const char* frame : {"bt.0001.vdb", "ba.0001.vdb"})
    EXPECT_TRUE(inspectVdb(at(frame)).grids.empty());
  EXPECT_EQ(inspectVdb(at("ba.0003.vdb")).grids.size(), 1u);
}

class VectorConversion : public Conversion {
 protected:
  void SetUp() override {
    writeVectorInput(in(), {.voxels = cloud(12)}, {{.voxels = softBall({})}});
  }
  [[nodiscard]] openvdb::GridBase::Ptr written() const {
    openvdb::initialize();
    openvdb::io::File file(back());
    file.open(false);
    return file.readGrid("velocity");
  }
};

TEST_F(VectorConversion, RestoresAllPropertiesOfTheGrid) {
  thereAndBack("--preset draft --measure values");
  ASSERT_EQ(readEsvr(out()).vectors, (std::vector<StoredVector>{{"velocity", 0}}));
  succeeded(check(back(), "--fail-on all --min-psnr 30"));
  const auto grid = openvdb::gridPtrCast<openvdb::Vec3SGrid>(written());
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_STAGGERED);
  EXPECT_EQ(grid->getVectorType(), openvdb::VEC_CONTRAVARIANT_RELATIVE);
  EXPECT_EQ(grid->background(), openvdb::Vec3s(0, 0, 0.5f));
  EXPECT_EQ(grid->metaValue<std::string>("note"), "of velocity");
  EXPECT_EQ(inspectVdb(back()).grids[1].name, "density");
}

TEST_F(VectorConversion, WritesNanoVdbThatIsConvertedAgain) {
  for (const char* goal : {"--lossless", "--preset=draft"}) {
    const Words options{in(), out(), "--force", goal};
    succeeded(vdb2esvr(options));
    EXPECT_THAT(succeeded(esvr2vdb({out(), at("back.nvdb"), "--force"})).err,
                Not(HasSubstr("is left out: ")));
    succeeded(esvr2vdb({out(), back(), "--force"}));
    succeeded(
        compare("check", {back(), at("back.nvdb"), "--max-error", "0", "--fail-on", "class"}));
    const auto again =
        succeeded(vdb2esvr({at("back.nvdb"), at("again.esvr"), "--force", "--lossless"}));
    EXPECT_EQ(readEsvr(at("again.esvr")).vectors.size(), 1u);
  }
}

TEST_F(VectorConversion, KeepsABoundForEachComponent) {
  thereAndBack("--max-error 0.01 --representation voxels");
  ASSERT_EQ(readEsvr(out()).vectors.size(), 1u);
  const VectorGrid a = readVector(in(), "velocity"), b = readVector(back(), "velocity");
  const VectorMetrics metrics = compareVectors(a.components, b.components);
  for (const auto& component : metrics.components) EXPECT_LE(component.maxError, 0.01);
  EXPECT_GT(metrics.components[0].maxError, 0.0);
}

TEST_F(VectorConversion, KeepsAPercentageThatACheckUnderstandsInTheSameWay) {
  thereAndBack("--max-error 1% --representation voxels");
  ASSERT_EQ(readEsvr(out()).vectors.size(), 1u);
  succeeded(check(back(), "--max-error 1%"));
  const VectorGrid a = readVector(in(), "velocity"), b = readVector(back(), "velocity");
  const VectorMetrics metrics = compareVectors(a.components, b.components);
  const double bound = 0.01 * valueRangeOfVectors(a.components);
  for (const auto& component : metrics.components) EXPECT_LE(component.maxError, bound);
  EXPECT_GT(metrics.components[1].maxError, 0.5 * bound)
      << "the smaller component has the bound of the larger one";
  EXPECT_THAT(check(back(), "--max-error 0.5%"), Fails(4));
}

TEST_F(VectorConversion, IsLosslessForEachComponent) {
  thereAndBack("--lossless --representation voxels");
  ASSERT_EQ(readEsvr(out()).vectors.size(), 1u);
  const VectorGrid a = readVector(in(), "velocity"), b = readVector(back(), "velocity");
  for (std::size_t c = 0; c < kComponents; ++c)
    EXPECT_EQ(volumeDifference(a.components[c], b.components[c]), "");
}

TEST_F(VectorConversion, ReachesAPsnrWithThePeakOfTheLongestVector) {
  thereAndBack("--psnr 40");
  const VectorGrid a = readVector(in(), "velocity"), b = readVector(back(), "velocity");
  const double peak = peakOfVectors(a.components);
  for (const auto& component : compareVectors(a.components, b.components).components) {
    EXPECT_DOUBLE_EQ(component.peak, peak);
    EXPECT_GE(component.psnrBox, 40.0);
  }
}

TEST_F(VectorConversion, FitsIntoASizeWithItsRecord) {
  succeeded(vdb2esvr({in(), out(), "--size", "6000B"}));
  EXPECT_LE(inspectEsvr(out()).fileBytes, 6000u);
  EXPECT_EQ(readEsvr(out()).vectors.size(), 1u);
}

TEST_F(VectorConversion, CarriesVectorsThatAreSmallerUnchanged) {
  writeVectorInput(in(), {.voxels = {{{1, 2, 3}, 1.0f}}});
  const auto run = succeeded(vdb2esvr({in(), out()}));
  const EsvrFile file = readEsvr(out());
  EXPECT_TRUE(file.grids.empty());
  EXPECT_EQ(file.carried.size(), 1u);
  EXPECT_THAT(run.out, HasSubstr("its components would take"));
}

TEST_F(VectorConversion, OfDoublesIsCarriedInALosslessFileAndFittedOtherwise) {
  writeVectorInput(in(), {.voxels = cloud(12), .asDouble = true});
  EXPECT_THAT(succeeded(vdb2esvr({in(), out(), "--lossless"})).out,
              HasSubstr("its values are doubles"));
  thereAndBack("--preset draft --measure values");
  EXPECT_EQ(readEsvr(out()).vectors.size(), 1u);
  EXPECT_TRUE(openvdb::gridPtrCast<openvdb::Vec3DGrid>(written()));
}

TEST_F(VectorConversion, WithANumberThatIsNotFiniteIsRefusedOrReplaced) {
  auto voxels = cloud(12);
  voxels.push_back({{30, 0, 0}, std::numeric_limits<float>::infinity()});
  writeVectorInput(in(), {.voxels = voxels, .scale = {1.0f, 1.0f, 1.0f}});
  EXPECT_THAT(vdb2esvr({in(), out()}), Fails(3, "velocity.x", "(30, 0, 0)"));
  succeeded(vdb2esvr({in(), out(), "--nonfinite", "zero"}));
}

TEST_F(VectorConversion, IsSummarisedReportedAndListed) {
  EXPECT_THAT(succeeded(vdb2esvr({in(), out(), "--report", at("r.json")})).out,
              Says("velocity.z", "vectors"));
  const auto report = Json::parse(readText(at("r.json")));
  ASSERT_EQ(report["vectors"].size(), 1u);
  const auto& vector = report["vectors"][0];
  EXPECT_EQ(vector["name"], "velocity");
  EXPECT_EQ(vector["value_type"], "vec3s");
  EXPECT_EQ(vector["components"][2]["name"], "velocity.z");
  EXPECT_GT(vector["metrics"]["psnr_box"], 30.0);
  EXPECT_EQ(report["grids"][1]["component_of"], "velocity");
  EXPECT_EQ(report["grids"][3]["component_of"], nullptr);
  EXPECT_EQ(report["input"]["bytes_converted"], report["input"]["bytes"]);
  const auto list = esvr2vdb({"--list", "-v", out()});
  EXPECT_THAT(list.out, Says("vec3s", "vector grid"));
  EXPECT_THAT(list.out, ContainsRegex("velocity  .* -  .*-  .*-  +[0-9]+  +-")) << "columns";
}

TEST_F(VectorConversion, ComparesWithItsReference) {
  succeeded(vdb2esvr({in(), out()}));
  EXPECT_THAT(succeeded(esvr2vdb({out(), back(), "--reference", in()})).out,
              HasSubstr("velocity.y"));
}

TEST_F(VectorConversion, FailsTheCheckIfOneComponentIsWrong) {
  thereAndBack("--lossless --representation voxels");
  succeeded(check(back(), "--max-error 0"));
  writeVectorInput(back(), {.voxels = cloud(12), .scale = {1.0f, -0.5f, 0.1f}},
                   {{.voxels = softBall({})}});
  EXPECT_THAT(check(back(), "--max-error 0.01"), Fails(4, "grid \"velocity.z\": max error 0.1"));
}

TEST_F(VectorConversion, WritesAPartOfTheVectors) {
  thereAndBack();
  succeeded(esvr2vdb({out(), back(), "--force", "--bbox", "0,0,0,3,3,3"}));
  EXPECT_EQ(inspectVdb(back()).grids[0].activeVoxels, 64u);
}

// ---- What grids share

constexpr double kStandardPsnr = 40.0;

class SharingGrids : public Conversion {
 protected:
  void SetUp() override {
    writeInput(in(), {{.name = "density", .voxels = softBall({})},
                      {.name = "heat", .voxels = softBall({}, 40.0f)},
                      {.name = "far", .voxels = softBall({40, 0, 0}, 2.0f)}});
  }

  [[nodiscard]] ProgramRun run(const Words& options) const {
    return convert(joined({"--device", "cpu", "--representation", "voxels", "--measure", "values",
                           "--report", at("r.json")},
                          options));
  }
  Json reportOf(const Words& options = {}) {
    run_ = succeeded(run(options));
    return Json::parse(readText(at("r.json")));
  }
  ProgramRun run_;
};

TEST_F(SharingGrids, takeFewerBytesWithTheSameQuality) {
  reportOf("--share off");
  const std::uint64_t apart = sizeOf("out.esvr");
  EXPECT_EQ(inspectEsvr(out()).versionMinor, 0);
  const Json report = reportOf();
  EXPECT_LT(3 * sizeOf("out.esvr"), 2 * apart);
  EXPECT_EQ(inspectEsvr(out()).versionMinor, 4);
  EXPECT_EQ(readEsvr(out()).grids[1].reference->grid, std::size_t{0});
  for (const Json& grid : report["grids"]) EXPECT_GE(grid["metrics"]["psnr_active"], kStandardPsnr);

  const Json heat = report["grids"][1];
  EXPECT_EQ(report["asked"]["share"], "auto");
  EXPECT_EQ(heat["shared"]["with"], "density");
  EXPECT_LT(heat["shared"]["bytes_with"], heat["shared"]["bytes_without"]);
  EXPECT_GE(report["output"]["bytes_separate"], apart);
  EXPECT_THAT(run_.out, Says("heat: refers to density", "bytes smaller"));
}

TEST_F(SharingGrids, areReadOneByOne) {
  reportOf();
  const std::string back = folder_ / "back.vdb", all = folder_ / "all.vdb";
  succeeded(esvr2vdb({out(), back, "-g", "heat"}));
  succeeded(esvr2vdb({out(), all}));
  EXPECT_EQ(inspectVdb(back).grids.size(), 1u);
  EXPECT_EQ(readGrid(back, "heat").volume.values, readGrid(all, "heat").volume.values);
  succeeded(esvr2vdb({"--check", out()}));
  EXPECT_THAT(esvr2vdb({"--list", out()}).out, Says("related voxels", "grid records"));
  EXPECT_THAT(esvr2vdb({"--list", "-v", out()}).out, HasSubstr("voxels refer to density"));
}

TEST_F(SharingGrids, thatDoNotExistAreRefused) {
  for (const Words& options : {Words{"--psnr", "smoke=40"}, {"--max-error", "smoke=1%"}})
    EXPECT_THAT(this->run(options), Fails(3, "smoke", "\"density\", \"heat\"")) << options[0];
}

TEST_F(SharingGrids, keepToASizeTogether) {
  const Json report = reportOf("--size 2000");
  EXPECT_LE(sizeOf("out.esvr"), 2000u);
  EXPECT_GT(report["output"]["bytes_separate"], report["output"]["bytes"]);
}

TEST_F(SharingGrids, takeFewerBytesInTheFramesOfAFile) {
  for (int frame = 1; frame <= 3; ++frame)
    writeInput(folder_ / ("in.000" + std::to_string(frame) + ".vdb"),
               {{.name = "density", .voxels = softBall({frame, 0, 0})},
                {.name = "heat", .voxels = softBall({frame, 0, 0}, 40.0f)}});
  const Words command{
      folder_ / "in.####.vdb", out(),    "--frames", "1-3",       "--device", "cpu",
      "--representation",      "voxels", "--force",  "--measure", "values",   "--share"};
  std::vector<std::uint64_t> bytes;
  for (const char* share : {"off", "auto"}) {
    Words arguments = command;
    arguments.emplace_back(share);
    succeeded(vdb2esvr(arguments));
    bytes.push_back(sizeOf("out.esvr"));
  }
  EXPECT_LT(bytes[1], bytes[0]);
  succeeded(esvr2vdb({out(), folder_ / "back.####.vdb"}));
  const VolumeGrid source = readGrid(folder_ / "in.0003.vdb", "heat"),
                   found = readGrid(folder_ / "back.0003.vdb", "heat");
  EXPECT_GE(compareVolumes(source.volume, found.volume).psnrActive, kStandardPsnr);
}

TEST_F(SharingGrids, mayHaveGoalsOfTheirOwn) {
  const Json report = reportOf("--psnr 30,heat=50 --share off");
  const Json &density = report["grids"][0]["metrics"], &heat = report["grids"][1]["metrics"];
  EXPECT_GE(density["psnr_box"], 30.0);
  EXPECT_LT(density["psnr_box"], 40.0);
  EXPECT_GE(heat["psnr_box"], 50.0);
  EXPECT_EQ(report["asked"]["psnr"], 30.0);
  EXPECT_EQ(report["asked"]["goals"][0]["grid"], "heat");
}

TEST_F(SharingGrids, withTwoGoalsAreRefused) {
  for (const Words& options : {Words{"--psnr", "heat=40,heat=50"},
                               {"--psnr", "heat=40", "--max-error", "heat=1%"},
                               {"--psnr", "40", "--max-error", "1%"},
                               {"--psnr", "40,50"},
                               {"--psnr", "=40"},
                               {"--psnr", "heat=warm"},
                               {"--psnr", "heat=1000"},
                               {"--max-error", "heat=0"},
                               {"--psnr", "heat=40", "--size", "5000"},
                               {"--psnr", "heat=40", "--count", "10"}})
    EXPECT_THAT(run(options), Fails(2)) << testing::PrintToString(options);
}

/// Bytes of the name, the transform, the metadata and the rows of a grid at most.
constexpr std::uint64_t kBytesOfATwin = 600;

class Twins : public Conversion {
 protected:
  /// Runs vdb2esvr for these grids. \return the report
  Json reportOf(const std::vector<InputGrid>& grids, const Words& options) {
    writeInput(in(), grids);
    run_ = succeeded(convert(joined({"--device", "cpu", "--report", at("r.json")}, options)));
    return Json::parse(readText(at("r.json")));
  }
  ProgramRun run_;
};

const Words kQuick{"--count", "30", "--iterations", "60", "--representation", "ellipsoids"};

/// Three grids, of which the first and the last one have the same voxels.
std::vector<InputGrid> twoAlike() {
  return {{.name = "red", .voxels = softBall({})},
          {.name = "heat", .voxels = softBall({}, 2.0f)},
          {.name = "green", .voxels = softBall({}), .map = InputMap::kRotated}};
}

TEST_F(Twins, addTheirDescriptorsOnly) {
  for (const auto& options : {kQuick, Words{"--lossless"}}) {
    const std::vector<InputGrid> grids = twoAlike();
    reportOf({grids[0], grids[1]}, options);
    const std::uint64_t without = sizeOf("out.esvr");
    reportOf(grids, options);
    EXPECT_LT(sizeOf("out.esvr"), without + kBytesOfATwin) << options[0];
    EXPECT_THAT(readEsvr(out()).grids, testing::SizeIs(3));
  }
}

TEST_F(Twins, comeBackWithTheirOwnDescriptors) {
  reportOf(twoAlike(), "--lossless");
  const std::string back = folder_ / "back.vdb";
  succeeded(esvr2vdb({out(), back}));
  for (const char* name : {"red", "heat", "green"}) {
    const VolumeGrid source = readGrid(in(), name), found = readGrid(back, name);
    EXPECT_EQ(found.descriptor, source.descriptor) << name;
    EXPECT_EQ(volumeDifference(found.volume, source.volume), "") << name;
  }
}

TEST_F(Twins, areNamedByTheReportAndTheSummary) {
  const Json grids = reportOf(twoAlike(), kQuick)["grids"];
  EXPECT_TRUE(grids[0]["same_as"].is_null());
  EXPECT_TRUE(grids[1]["same_as"].is_null());
  EXPECT_EQ(grids[2]["same_as"], "red");
  EXPECT_EQ(grids[2]["metrics"], grids[0]["metrics"]);
  EXPECT_EQ(grids[2]["seconds"]["optimise"], 0.0);
  EXPECT_LT(grids[2]["bytes"], grids[0]["bytes"]);
  EXPECT_EQ(grids[2]["sections"][0]["shared"], true);
  EXPECT_THAT(run_.out, Says("green: stored once with red", Not(HasSubstr("heat: stored"))));
}

TEST_F(Twins, areListedWithoutCountingTheirBytesTwice) {
  const Json grids = reportOf(twoAlike(), "--lossless")["grids"];
  const auto list = esvr2vdb({"--list", out()});
  EXPECT_THAT(list.out, HasSubstr("shared with"));
  std::uint64_t sum = 0;
  for (const Json& grid : grids) sum += grid["bytes"].get<std::uint64_t>();
  EXPECT_LT(sum, sizeOf("out.esvr"));
  EXPECT_THAT(list.out, HasSubstr(" " + grids[2]["bytes"].dump() + " "));
}

TEST_F(Twins, ofATwinAreNamedAfterTheFirst) {
  const InputGrid ball{.voxels = softBall({})};
  const Json grids = reportOf({ball, ball, ball}, kQuick)["grids"];
  for (const std::size_t twin : {1, 2}) EXPECT_EQ(grids[twin]["same_as"], "density[0]");
}

}  // namespace

}  // namespace esvr::test
