// Plan: files whose grids share names, look numbered or look like components go through all
// programs, and each grid keeps its own value. A name means the same grid in the .vdb and in the
// .esvr file. Files without grids are valid, alone and in sequences. Names cannot control the
// terminal. Grids of vectors are converted and converted back. Type, class, vector type,
// transform, metadata, background and active voxels are those of the source. The goals hold for
// each component. Vectors that are smaller unchanged are carried. The summary, the report, --list,
// --reference and esvr-compare treat the components as one grid.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/run_program.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "vdb/open_vdb.h"

#include <openvdb/io/File.h>

namespace esvr {
namespace {

using test::InputVectors;
using testing::AllOf;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

using Values = std::vector<float>;

class NamedGrids : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return folder_ / name; }

  /// Writes grids of one voxel, whose values are 1, 2, ...
  void write(const std::vector<std::string>& names) const {
    std::vector<test::InputGrid> grids;
    for (const auto& name : names)
      grids.push_back({.name = name, .voxels = {{{0, 0, 0}, float(grids.size() + 1)}}});
    test::writeInput(at("in.vdb"), grids);
  }

  void convert(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {at("in.vdb"), at("out.esvr"), "--force"});
    const auto run = test::vdb2esvr(more);
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto back = test::esvr2vdb({at("out.esvr"), at("back.vdb"), "--force"});
    ASSERT_EQ(back.exitCode, 0) << back.err;
  }

  [[nodiscard]] Values valuesIn(const std::string& file) const {
    Values values;
    for (std::size_t g = 0; g < inspectVdb(at(file)).grids.size(); ++g)
      values.push_back(activeRange(readGrid(at(file), g).volume).max);
    return values;
  }

  [[nodiscard]] test::ProgramRun check(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"check", at("in.vdb"), at("out.esvr")});
    return test::runProgram(ESVR_COMPARE, more);
  }

  test::TemporaryFolder folder_;
};

TEST_F(NamedGrids, KeepTheirValuesWhateverTheyAreCalled) {
  for (const std::vector<std::string>& names : {std::vector<std::string>{"a", "a", "a[1]"},
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
      convert({"--lossless", "--share", share});
      EXPECT_EQ(valuesIn("back.vdb"), expected) << names.front() << " " << share;
    }
    const auto run = check({"--max-error", "0"});
    EXPECT_EQ(run.exitCode, 0) << run.err << run.out;
  }
}

TEST_F(NamedGrids, AreFoundByTheSameNamesInBothFiles) {
  write({"a", "a", "a[1]"});
  convert({"--lossless"});
  const auto listed = test::esvr2vdb({"--list", at("out.esvr")});
  EXPECT_THAT(listed.out, AllOf(HasSubstr("a[0] "), HasSubstr("a#2 "), HasSubstr("a[1] ")));
  const EsvrFile file = readEsvr(at("out.esvr"));
  for (const auto& [name, value] : {std::pair("a[0]", 1.0f), {"a#2", 2.0f}, {"a[1]", 3.0f}}) {
    EXPECT_EQ(readGrid(at("in.vdb"), name).volume.values[0], value);
    EXPECT_EQ(decodeGrid(file.grids[findStored(file, name)]).values[0], value);
    const auto run = test::esvr2vdb(
        {at("out.esvr"), at("one.vdb"), "-g", name, "--force", "--reference", at("in.vdb")});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(valuesIn("one.vdb"), Values{value});
    EXPECT_THAT(run.out, HasSubstr("exact")) << name;
  }
}

TEST_F(NamedGrids, AreToldWhereANameIsAmbiguous) {
  write({"a", "a", "b"});
  const auto run = test::vdb2esvr({at("in.vdb"), at("out.esvr"), "-g", "a"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("has 2 grids \"a\""),
                             HasSubstr("\"a[0]\" (grid 1 of the file), \"a[1]\" (grid 2")));
  EXPECT_EQ(test::vdb2esvr({at("in.vdb"), at("out.esvr"), "-g", "a[1]"}).exitCode, 0);
}

TEST_F(NamedGrids, AreComparedWithThoseThatTheyComeFromAfterOthersWereLeftOut) {
  write({"a", "a", "a"});
  convert({"--lossless", "--skip", "a[0]"});
  const auto run = check();
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, AllOf(HasSubstr("\"a[0]\" is missing"), Not(HasSubstr("\"a[1]\"")),
                             Not(HasSubstr("\"a[2]\"")), Not(HasSubstr("not in the reference"))));
  const auto ignoring = check({"--ignore-grids", "a[0]", "--max-error", "0"});
  EXPECT_EQ(ignoring.exitCode, 0) << ignoring.err;
  EXPECT_EQ(check({"-g", "a[2]", "--max-error", "0"}).exitCode, 0);
}

TEST_F(NamedGrids, WinOverComponentsOfTheirName) {
  test::writeVectorInput(at("in.vdb"), {.name = "vel", .voxels = test::softBall({})},
                         {{.name = "vel.x", .voxels = {{{0, 0, 0}, 7.0f}}}});
  convert({"--lossless", "--representation", "voxels"});
  const EsvrFile file = readEsvr(at("out.esvr"));
  EXPECT_EQ(activeRange(readGrid(at("in.vdb"), "vel.x").volume).max, 7.0f);
  ASSERT_EQ(file.vectors.size(), 1u);
  EXPECT_EQ(file.grids[findStored(file, "vel.x")].valueMax, 7.0f);
  EXPECT_EQ(findStored(file, "vel[0].x"), 0u);
  EXPECT_EQ(findStored(file, "vel.y"), 1u);
  const auto run = check();
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.out.find("vel.x "), run.out.rfind("vel.x ")) << run.out;
}

TEST_F(NamedGrids, WithoutANameAreShownAsSuch) {
  write({""});
  const auto run = test::vdb2esvr({at("in.vdb"), at("out.esvr"), "--keep", ""});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("(unnamed): carried unchanged"));
  EXPECT_THAT(test::esvr2vdb({"--list", "-v", at("out.esvr")}).out, Not(HasSubstr("\n:")));
}

TEST_F(NamedGrids, CannotControlTheTerminal) {
  const std::string name = "a\x1b[2J\xc2\x9b\n\xe2\x80\xae";
  write({name, "b"});
  const std::vector<test::ProgramRun> runs{
      test::vdb2esvr({at("in.vdb"), at("out.esvr"), "-v", "--report", "-"}),
      test::vdb2esvr({at("in.vdb"), at("two.esvr"), "-g", "c"}),
      test::esvr2vdb({"--list", "-v", at("out.esvr")}),
      test::esvr2vdb({"--list", "-v", at("in.vdb")}),
      test::esvr2vdb({at("out.esvr"), at("x.vdb"), "-g", "c"}),
      check({"-g", "b"}),
      check({"--min-psnr", "500"})};
  for (const auto& run : runs)
    for (const std::string& text : {run.out, run.err})
      for (const char* part : {"\x1b", "\xc2\x9b", "\xe2\x80\xae", "a?[2J?\n"})
        EXPECT_THAT(text, Not(HasSubstr(part)));
  EXPECT_THAT(runs[3].out, HasSubstr("a?[2J???"));
  convert({"--lossless"});
  EXPECT_EQ(inspectVdb(at("back.vdb")).grids[0].name, name);
}

TEST_F(NamedGrids, MayBeMissingInAFileAltogether) {
  test::writeInput(at("in.vdb"), {});
  convert();
  EXPECT_TRUE(inspectVdb(at("back.vdb")).grids.empty());
  EXPECT_EQ(stringValue(inspectVdb(at("back.vdb")).metadata, "creator"), test::kInputCreator);
  for (const char* file : {"in.vdb", "out.esvr"}) {
    const auto listed = test::esvr2vdb({"--list", at(file)});
    EXPECT_EQ(listed.exitCode, 0) << listed.err;
    EXPECT_THAT(listed.out, HasSubstr("bytes, no grid"));
  }
  const auto same = check();
  EXPECT_EQ(same.exitCode, 0) << same.err;
  EXPECT_THAT(same.out, HasSubstr("no grid in either file"));
  const auto nano = test::esvr2vdb({at("out.esvr"), at("x.nvdb")});
  EXPECT_EQ(nano.exitCode, 3);
  EXPECT_THAT(nano.err, HasSubstr("has no grid, and a .nvdb file cannot be without one"));
  EXPECT_FALSE(std::filesystem::exists(at("x.nvdb")));
  EXPECT_EQ(test::vdb2esvr({at("in.vdb"), at("y.esvr"), "-g", "density"}).exitCode, 3);
  const auto drawn = test::runProgram(ESVR_RENDER, {at("out.esvr"), at("x.png")});
  EXPECT_EQ(drawn.exitCode, 3);
  EXPECT_THAT(drawn.err, HasSubstr("no grid"));
}

TEST_F(NamedGrids, MayBeMissingInTheFirstFrame) {
  test::writeInput(at("s.0001.vdb"), {});
  for (const char* frame : {"s.0002.vdb", "s.0003.vdb"})
    test::writeInput(at(frame), {{.voxels = test::softBall({})}});
  for (const char* output : {"t.####.esvr", "all.esvr"}) {
    const auto run = test::vdb2esvr({at("s.####.vdb"), at(output), "-g", "density", "--ratio", "2",
                                     "--report", at(std::string("r") + output[0] + ".json")});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto back = test::esvr2vdb({at(output), at(std::string("b") + output[0] + ".####.vdb")});
    ASSERT_EQ(back.exitCode, 0) << back.err;
    const auto same = test::runProgram(ESVR_COMPARE, {"check", at("s.####.vdb"), at(output)});
    EXPECT_EQ(same.exitCode, 0) << same.err;
    EXPECT_THAT(same.out, HasSubstr("frame 1: no grid in either file"));
  }
  for (const char* frame : {"bt.0001.vdb", "ba.0001.vdb"})
    EXPECT_TRUE(inspectVdb(at(frame)).grids.empty());
  EXPECT_EQ(inspectVdb(at("ba.0003.vdb")).grids.size(), 1u);
}

class VectorConversion : public test::FolderTest {
 protected:
  void SetUp() override {
    test::writeVectorInput(in(), {.voxels = test::cloud(12)}, {{.voxels = test::softBall({})}});
  }
  [[nodiscard]] std::string in() const { return at("in.vdb"); }
  [[nodiscard]] std::string out() const { return at("out.esvr"); }
  [[nodiscard]] std::string back() const { return at("back.vdb"); }
  void convertThereAndBack(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {in(), out(), "--force"});
    const auto there = test::vdb2esvr(more);
    ASSERT_EQ(there.exitCode, 0) << there.err;
    const auto run = test::esvr2vdb({out(), back(), "--force"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
  [[nodiscard]] test::ProgramRun check(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"check", in(), back()});
    return test::runProgram(ESVR_COMPARE, more);
  }
  [[nodiscard]] openvdb::GridBase::Ptr written() const {
    openvdb::initialize();
    openvdb::io::File file(back());
    file.open(false);
    return file.readGrid("velocity");
  }
};

TEST_F(VectorConversion, RestoresAllPropertiesOfTheGrid) {
  convertThereAndBack({"--preset", "draft", "--measure", "values"});
  ASSERT_EQ(readEsvr(out()).vectors, (std::vector<StoredVector>{{"velocity", 0}}));
  const auto run = check({"--fail-on", "all", "--min-psnr", "30"});
  EXPECT_EQ(run.exitCode, 0) << run.out << run.err;
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
    const std::vector<std::string> options{in(), out(), "--force", goal};
    ASSERT_EQ(test::vdb2esvr(options).exitCode, 0);
    const auto run = test::esvr2vdb({out(), at("back.nvdb"), "--force"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_THAT(run.err, Not(HasSubstr("is left out: ")));
    ASSERT_EQ(test::esvr2vdb({out(), back(), "--force"}).exitCode, 0);
    const auto same = test::runProgram(
        ESVR_COMPARE, {"check", back(), at("back.nvdb"), "--max-error", "0", "--fail-on", "class"});
    EXPECT_EQ(same.exitCode, 0) << same.out << same.err;
    const auto again = test::vdb2esvr({at("back.nvdb"), at("again.esvr"), "--force", "--lossless"});
    EXPECT_EQ(again.exitCode, 0) << again.err;
    EXPECT_EQ(readEsvr(at("again.esvr")).vectors.size(), 1u);
  }
}

TEST_F(VectorConversion, KeepsABoundForEachComponent) {
  convertThereAndBack({"--max-error", "0.01", "--representation", "voxels"});
  ASSERT_EQ(readEsvr(out()).vectors.size(), 1u);
  const VectorGrid a = readVector(in(), "velocity"), b = readVector(back(), "velocity");
  const VectorMetrics metrics = compareVectors(a.components, b.components);
  for (const auto& component : metrics.components) EXPECT_LE(component.maxError, 0.01);
  EXPECT_GT(metrics.components[0].maxError, 0.0);
}

TEST_F(VectorConversion, KeepsAPercentageThatACheckUnderstandsInTheSameWay) {
  convertThereAndBack({"--max-error", "1%", "--representation", "voxels"});
  ASSERT_EQ(readEsvr(out()).vectors.size(), 1u);
  const auto run = check({"--max-error", "1%"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const VectorGrid a = readVector(in(), "velocity"), b = readVector(back(), "velocity");
  const VectorMetrics metrics = compareVectors(a.components, b.components);
  const double bound = 0.01 * valueRangeOfVectors(a.components);
  for (const auto& component : metrics.components) EXPECT_LE(component.maxError, bound);
  EXPECT_GT(metrics.components[1].maxError, 0.5 * bound)
      << "the smaller component has the bound of the larger one";
  EXPECT_EQ(check({"--max-error", "0.5%"}).exitCode, 4);
}

TEST_F(VectorConversion, IsLosslessForEachComponent) {
  convertThereAndBack({"--lossless", "--representation", "voxels"});
  ASSERT_EQ(readEsvr(out()).vectors.size(), 1u);
  const VectorGrid a = readVector(in(), "velocity"), b = readVector(back(), "velocity");
  for (std::size_t c = 0; c < kComponents; ++c) {
    EXPECT_EQ(a.components[c].values, b.components[c].values);
    EXPECT_EQ(a.components[c].active, b.components[c].active);
  }
}

TEST_F(VectorConversion, ReachesAPsnrWithThePeakOfTheLongestVector) {
  convertThereAndBack({"--psnr", "40"});
  const VectorGrid a = readVector(in(), "velocity"), b = readVector(back(), "velocity");
  const double peak = peakOfVectors(a.components);
  for (const auto& component : compareVectors(a.components, b.components).components) {
    EXPECT_DOUBLE_EQ(component.peak, peak);
    EXPECT_GE(component.psnrBox, 40.0);
  }
}

TEST_F(VectorConversion, FitsIntoASizeWithItsRecord) {
  const auto run = test::vdb2esvr({in(), out(), "--size", "6000B"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LE(inspectEsvr(out()).fileBytes, 6000u);
  EXPECT_EQ(readEsvr(out()).vectors.size(), 1u);
}

TEST_F(VectorConversion, CarriesVectorsThatAreSmallerUnchanged) {
  test::writeVectorInput(in(), {.voxels = {{{1, 2, 3}, 1.0f}}});
  const auto run = test::vdb2esvr({in(), out()});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const EsvrFile file = readEsvr(out());
  EXPECT_TRUE(file.grids.empty());
  EXPECT_EQ(file.carried.size(), 1u);
  EXPECT_THAT(run.out, HasSubstr("its components would take"));
}

TEST_F(VectorConversion, OfDoublesIsCarriedInALosslessFileAndFittedOtherwise) {
  test::writeVectorInput(in(), {.voxels = test::cloud(12), .asDouble = true});
  const auto run = test::vdb2esvr({in(), out(), "--lossless"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("its values are doubles"));
  convertThereAndBack({"--preset", "draft", "--measure", "values"});
  EXPECT_EQ(readEsvr(out()).vectors.size(), 1u);
  EXPECT_TRUE(openvdb::gridPtrCast<openvdb::Vec3DGrid>(written()));
}

TEST_F(VectorConversion, WithANumberThatIsNotFiniteIsRefusedOrReplaced) {
  auto voxels = test::cloud(12);
  voxels.push_back({{30, 0, 0}, std::numeric_limits<float>::infinity()});
  test::writeVectorInput(in(), {.voxels = voxels, .scale = {1.0f, 1.0f, 1.0f}});
  const auto run = test::vdb2esvr({in(), out()});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("velocity.x"), HasSubstr("(30, 0, 0)")));
  EXPECT_EQ(test::vdb2esvr({in(), out(), "--nonfinite", "zero"}).exitCode, 0);
}

TEST_F(VectorConversion, IsSummarisedReportedAndListed) {
  const auto run = test::vdb2esvr({in(), out(), "--report", at("r.json")});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("velocity.z"), HasSubstr("vectors")));
  const auto report = nlohmann::json::parse(test::readText(at("r.json")));
  ASSERT_EQ(report["vectors"].size(), 1u);
  const auto& vector = report["vectors"][0];
  EXPECT_EQ(vector["name"], "velocity");
  EXPECT_EQ(vector["value_type"], "vec3s");
  EXPECT_EQ(vector["components"][2]["name"], "velocity.z");
  EXPECT_GT(vector["metrics"]["psnr_box"], 30.0);
  EXPECT_EQ(report["grids"][1]["component_of"], "velocity");
  EXPECT_EQ(report["grids"][3]["component_of"], nullptr);
  EXPECT_EQ(report["input"]["bytes_converted"], report["input"]["bytes"]);
  const auto list = test::esvr2vdb({"--list", "-v", out()});
  EXPECT_THAT(list.out, AllOf(HasSubstr("vec3s"), HasSubstr("vector grid")));
  EXPECT_THAT(list.out, ContainsRegex("velocity  .* -  .*-  .*-  +[0-9]+  +-")) << "columns";
}

TEST_F(VectorConversion, ComparesWithItsReference) {
  ASSERT_EQ(test::vdb2esvr({in(), out()}).exitCode, 0);
  const auto run = test::esvr2vdb({out(), back(), "--reference", in()});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("velocity.y"));
}

TEST_F(VectorConversion, FailsTheCheckIfOneComponentIsWrong) {
  convertThereAndBack({"--lossless", "--representation", "voxels"});
  EXPECT_EQ(check({"--max-error", "0"}).exitCode, 0);
  test::writeVectorInput(back(), {.voxels = test::cloud(12), .scale = {1.0f, -0.5f, 0.1f}},
                         {{.voxels = test::softBall({})}});
  const auto run = check({"--max-error", "0.01"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("grid \"velocity.z\": max error 0.1"));
}

TEST_F(VectorConversion, WritesAPartOfTheVectors) {
  convertThereAndBack();
  const auto run = test::esvr2vdb({out(), back(), "--force", "--bbox", "0,0,0,3,3,3"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(inspectVdb(back()).grids[0].activeVoxels, 64u);
}

}  // namespace
}  // namespace esvr
