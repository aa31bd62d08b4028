// Plan: files whose grids share names, look numbered or look like components go through all
// programs, and each grid keeps its own value under the same name. The components of vectors come
// back with everything of the source, and are one grid for the summary, the reports and the lists.

#include <limits>

#include "cli/conversion.h"
#include "vdb/open_vdb.h"

#include <openvdb/io/File.h>

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
  for (std::size_t c = 0; c < kComponents; ++c) {
    EXPECT_EQ(a.components[c].values, b.components[c].values);
    EXPECT_EQ(a.components[c].active, b.components[c].active);
  }
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

}  // namespace
}  // namespace esvr::test
