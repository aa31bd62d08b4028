// Plan: files whose grids share names, look numbered or look like components go through all programs,
// and each grid keeps its own value. A name means the same grid in the .vdb and in the .esvr file. Files
// without grids are valid, alone and in sequences. Names cannot control the terminal.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using testing::AllOf;
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

}  // namespace
}  // namespace esvr
