// Plan: grids of vectors are converted and converted back. Type, class, vector type, transform,
// metadata, background and active voxels are those of the source. The goals hold for each
// component. Vectors that are smaller unchanged are carried. The summary, the report, --list,
// --reference and esvr-compare treat the components as one grid.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/File.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/vdb_io.h"
#include "esvr/vector_metrics.h"
#include "vdb/trees.h"

namespace esvr {
namespace {

using test::InputVectors;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

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
  convertThereAndBack({"--preset", "draft"});
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
  convertThereAndBack({"--preset", "draft"});
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

TEST_F(VectorConversion, LeavesVectorsOutOfNanoVdb) {
  ASSERT_EQ(test::vdb2esvr({in(), out()}).exitCode, 0);
  const auto run = test::esvr2vdb({out(), at("back.nvdb")});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.err, HasSubstr("grid \"velocity\" is left out: vectors"));
  EXPECT_EQ(test::esvr2vdb({out(), at("no.nvdb"), "-g", "velocity"}).exitCode, 2);
}

TEST_F(VectorConversion, WritesAPartOfTheVectors) {
  convertThereAndBack();
  const auto run = test::esvr2vdb({out(), back(), "--force", "--bbox", "0,0,0,3,3,3"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(inspectVdb(back()).grids[0].activeVoxels, 64u);
}

}  // namespace
}  // namespace esvr
