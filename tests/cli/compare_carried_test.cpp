// Plan: `esvr-compare check` is run on files with grids that have no figures. A missing, an extra
// and a retyped grid fail, equal bytes pass, and --ignore-grids excludes a grid.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/File.h>

#include <nlohmann/json.hpp>

#include "cli/compare_fixture.h"
#include "vdb/empty_grid.h"

namespace esvr {
namespace {

using test::InputGrid;
using test::softBall;
using testing::AllOf;
using testing::HasSubstr;

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

}  // namespace
}  // namespace esvr
