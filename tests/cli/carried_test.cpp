// Plan: files with grids that cannot be fitted, that are empty or that the user wants unchanged are
// converted and converted back. Their bytes are compared with those of the source; the order of
// all grids, the summary, the report and the refusals are checked.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/File.h>

#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/grids_in_file.h"
#include "cli/refusal.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/vdb_io.h"
#include "vdb/empty_grid.h"
#include "vdb/nano_files.h"

namespace esvr {
namespace {

using test::bytesIn;
using test::namesIn;
using test::softBall;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// A folder with a file of the grids bool, int32, vec3s, points, density, empty and density.
class CarriedFile : public test::FolderTest {
 protected:
  void SetUp() override {
    test::writeMixedInput(
        in(), {{.voxels = softBall({})}, {.name = "empty"}, {.voxels = softBall({30, 0, 0})}});
  }
  [[nodiscard]] std::string in() const { return at("in.vdb"); }
  [[nodiscard]] std::string out() const { return at("out.esvr"); }
  [[nodiscard]] std::string back() const { return at("back.vdb"); }
  void convert(const std::vector<std::string>& more = {}) const {
    const auto run = test::quickFit(in(), out(), more);
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
  void convertBack(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {out(), back()});
    const auto run = test::esvr2vdb(more);
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
};

TEST_F(CarriedFile, GivesAllGridsBackInOrderAndThoseThatAreNotFittedBitForBit) {
  convert();
  convertBack();
  EXPECT_EQ(namesIn(back()), namesIn(in()));
  EXPECT_EQ(bytesIn(back(), {0, 1, 2, 3, 5}), bytesIn(in(), {0, 1, 2, 3, 5}));
  EXPECT_GT(readGrid(back(), "density[1]").descriptor.metadata.size(), 0u);
}

TEST_F(CarriedFile, KeepsANamedGridUnchanged) {
  convert({"--keep", "density[1]"});
  EXPECT_EQ(readEsvr(out()).grids.size(), 1u);
  convertBack();
  EXPECT_EQ(namesIn(back()), namesIn(in()));
  EXPECT_EQ(bytesIn(back(), {6}), bytesIn(in(), {6}));
}

TEST_F(CarriedFile, KeepsANamedGridBesideThoseOfTheOptionGrid) {
  convert({"-g", "density[0]", "--keep", "vec3s"});
  convertBack();
  EXPECT_THAT(namesIn(back()), ElementsAre("vec3s", "density"));
}

TEST_F(CarriedFile, LeavesOutTheGridsThatAreNamedBySkip) {
  const auto run = test::quickFit(in(), out(), {"--skip", "points", "--skip", "density[0]"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("points: left out"), HasSubstr("5 of 7 grids")));
  convertBack();
  EXPECT_THAT(namesIn(back()), ElementsAre("bool", "int32", "vec3s", "empty", "density"));
}

TEST_F(CarriedFile, WithNothingToFitIsConvertedWithAWarning) {
  const auto run = test::quickFit(in(), out(), {"-g", "int32", "-g", "empty"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.err, HasSubstr("carried grids only (2 of 2 grids are carried unchanged)"));
  convertBack();
  EXPECT_EQ(bytesIn(back()), bytesIn(in(), {1, 5}));
}

TEST_F(CarriedFile, IsSummarisedAndReported) {
  const auto run =
      test::quickFit(in(), out(), {"--skip", "bool", "--report", at("r.json"), "--keep", "points"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("int32: carried unchanged, because its values are of type"),
                             HasSubstr("empty: carried unchanged, because it has no active voxel"),
                             HasSubstr("points: carried unchanged, because --keep names it"),
                             HasSubstr("bool: left out, because --skip names it")));
  const auto report = nlohmann::json::parse(test::readText(at("r.json")));
  ASSERT_EQ(report["carried"].size(), 4u);
  EXPECT_EQ(report["carried"][0]["name"], "int32");
  EXPECT_GT(report["carried"][0]["bytes"], 0);
  EXPECT_EQ(report["carried"][0]["source_bytes"], inspectVdb(in()).grids[1].storedBytes);
  ASSERT_EQ(report["skipped"].size(), 1u);
  EXPECT_EQ(report["skipped"][0]["name"], "bool");
  EXPECT_EQ(report["asked"]["skip"], nlohmann::json::array({"bool"}));
}

TEST_F(CarriedFile, ListsItsCarriedGridsInOrder) {
  convert();
  const auto run = test::esvr2vdb({"--list", "-v", out()});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LT(run.out.find("vec3s"), run.out.find("density[0]"));
  EXPECT_THAT(run.out, AllOf(HasSubstr("carried bytes"),
                             HasSubstr("int32: carried unchanged, Tree_int32_5_4_3")));
}

TEST_F(CarriedFile, GivesBackTheCarriedGridsThatAreNamed) {
  convert();
  convertBack({"-g", "density[1]", "-g", "vec3s"});
  EXPECT_THAT(namesIn(back()), ElementsAre("vec3s", "density"));
  EXPECT_EQ(bytesIn(back(), {0}), bytesIn(in(), {2}));
}

TEST_F(CarriedFile, SaysWhichGridsNanoVdbAndPartsCannotHold) {
  convert();
  const auto nano = test::esvr2vdb({out(), at("back.nvdb")});
  EXPECT_EQ(nano.exitCode, 0) << nano.err;
  EXPECT_THAT(nano.err, AllOf(HasSubstr("grid \"vec3s\" is left out: a NanoVDB file"),
                              Not(HasSubstr("density[0]"))));
  const auto part = test::esvr2vdb({out(), back(), "--bbox", "0,0,0,7,7,7"});
  EXPECT_EQ(part.exitCode, 0) << part.err;
  EXPECT_THAT(part.err, HasSubstr("grid \"vec3s\" is left out: --lod"));
  EXPECT_THAT(namesIn(back()), ElementsAre("density[0]", "density[1]"));
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{at("no.nvdb")}, {at("no.vdb"), "--lod", "1"}}) {
    std::vector<std::string> arguments{out(), "-g", "vec3s"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto run = test::esvr2vdb(arguments);
    EXPECT_EQ(run.exitCode, 2);
    EXPECT_THAT(run.err, HasSubstr("grid \"vec3s\" cannot be written"));
  }
}

TEST_F(CarriedFile, WithDamagedBytesIsRefused) {
  convert();
  std::string bytes = test::readText(out());
  bytes.back() = char(bytes.back() ^ 1);
  test::writeText(out(), bytes);
  const auto run = test::esvr2vdb({out(), back()});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("section"), HasSubstr("checksum does not match")));
}

TEST_F(CarriedFile, OfFiveHundredGridsComesBack) {
  openvdb::GridPtrVec grids;
  for (int i = 0; i < 500; ++i) {
    grids.push_back(test::emptyGrid("Tree_int32_5_4_3", i % 3 ? "a" : "b"));
    grids.back()->insertMeta("number", openvdb::Int32Metadata(i));
  }
  openvdb::io::File(in()).write(grids);
  convert();
  convertBack();
  EXPECT_EQ(bytesIn(back()), bytesIn(in()));
}

/// A file with grids of metadata of this size.
void writeLarge(const std::string& path, int count, std::size_t bytes) {
  openvdb::GridPtrVec grids;
  for (int i = 0; i < count; ++i) {
    grids.push_back(test::emptyGrid("Tree_int32_5_4_3", "large"));
    grids.back()->insertMeta("text", openvdb::StringMetadata(std::string(bytes, 'x')));
  }
  openvdb::io::File(path).write(grids);
}

TEST_F(CarriedFile, SlowWithAGridLargerThanTheMemoryIsKeptInAFile) {
  writeLarge(in(), 1, 50'000'000);
  const std::vector<std::string> memory{"--max-memory", "40MB", "--scratch", folder_ / "."};
  convert(memory);
  convertBack(memory);
  EXPECT_EQ(bytesIn(back()), bytesIn(in()));
}

TEST_F(CarriedFile, WithGridsThatTakeMoreMemoryThanAllowedIsRefusedWithTheirName) {
  writeLarge(in(), 5, 2'000'000);  // each of them is within a quarter of the limit
  const auto run = test::quickFit(in(), out(), {"--max-memory", "9MB"});
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_THAT(run.err, AllOf(HasSubstr("in.vdb"), HasSubstr("large"), HasSubstr("10 MB")));
}

TEST_F(CarriedFile, SlowWithFiftyMegabytesOfFileMetadataComesBack) {
  openvdb::MetaMap metadata;
  metadata.insertMeta("text", openvdb::StringMetadata(std::string(50'000'000, 'x')));
  openvdb::io::File(in()).write({test::emptyGrid("Tree_int32_5_4_3", "a")}, metadata);
  convert({"--max-memory", "8GB"});
  convertBack({"--max-memory", "8GB"});
  EXPECT_EQ(stringValue(inspectVdb(back()).metadata, "text").size(), 50'000'000u);
  const auto run = test::esvr2vdb({out(), at("no.vdb"), "--max-memory", "100MB"});
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_THAT(run.err, HasSubstr("file metadata"));
}

TEST_F(CarriedFile, OfNanoVdbIsRefusedUnlessTheGridIsLeftOut) {
  test::saveNano(at("in.nvdb"), {test::emptyGrid("Tree_float_5_4_3", "none")});
  const auto run = test::quickFit(at("in.nvdb"), out());
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("\"none\" can be neither fitted (it has no active voxel)"),
                             HasSubstr("--skip")));
  EXPECT_EQ(test::quickFit(at("in.nvdb"), out(), {"--skip", "none"}).exitCode, 3);
}

class RefusedCarrying : public CarriedFile, public testing::WithParamInterface<test::Refusal> {};

TEST_P(RefusedCarrying, IsExplained) {
  std::vector<std::string> arguments{in(), out()};
  arguments.insert(arguments.end(), GetParam().arguments.begin(), GetParam().arguments.end());
  GetParam().expectOf(test::vdb2esvr(arguments));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedCarrying,
    testing::Values(
        test::Refusal{{"--skip", "points", "-g", "points"}, 2, "-g both name grid \"points\""},
        test::Refusal{{"--skip", "points", "--keep", "points"}, 2, "--keep both name"},
        test::Refusal{{"--keep", "fuel"}, 3, "no grid \"fuel\""},
        test::Refusal{{"--skip", "fuel"}, 3, "no grid \"fuel\""},
        test::Refusal{{"--size", "1500B"}, 2, "--skip leaves them out"},
        test::Refusal{{"--skip", "bool", "--skip", "int32", "--skip", "vec3s", "--skip", "points",
                       "--skip", "density[0]", "--skip", "density[1]", "--skip", "empty"},
                      3,
                      "all grids of the file are left out"}));

TEST_F(CarriedFile, RealFileOfTwentyFourGridsComesBackWithoutLoss) {
  if (std::string(ESVR_DATA_DIR).empty())
    GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
  const std::string frame = std::string(ESVR_DATA_DIR) + "/sequence/gas_0001.vdb";
  const auto run = test::vdb2esvr({frame, out(), "--lossless"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  convertBack();
  const auto source = inspectVdb(frame).grids;
  ASSERT_EQ(namesIn(back()), namesIn(frame));
  const auto before = bytesIn(frame), after = bytesIn(back());
  int carried = 0;
  for (std::size_t g = 0; g < source.size(); ++g) {
    SCOPED_TRACE(source[g].name);
    if (!source[g].skipReason.empty()) {
      EXPECT_EQ(after[g], before[g]);
      ++carried;
    } else {
      EXPECT_EQ(readGrid(back(), source[g].uniqueName).volume.values,
                readGrid(frame, source[g].uniqueName).volume.values);
    }
  }
  EXPECT_EQ(carried, 8);
}

}  // namespace
}  // namespace esvr
