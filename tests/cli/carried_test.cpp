// Plan: files with grids that cannot be fitted, that are empty or that the user wants unchanged
// are converted and converted back. Their bytes are compared with those of the source; the order
// of all grids, the summary, the report and the refusals are checked. What a grid holds besides
// finite active voxels of floats is kept, or the program says that it is not and how to keep it:
// values of inactive voxels, halfs, giant tiles, and all that a conversion refuses. Every promise
// is checked on the .vdb file that a user gets in the end.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/run_program.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"
#include "esvr/metrics.h"
#include "esvr/quantised.h"
#include "esvr/vdb_io.h"
#include "support/non_finite.h"
#include "vdb/foreign_grids.h"
#include "vdb/open_vdb.h"

#include <openvdb/io/File.h>

namespace esvr {
namespace {

using test::bytesIn;
using test::InputGrid;
using test::kNan;
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
  const auto lineAt = [&](const std::string& begin) {
    const auto at = run.out.find('\n' + begin + ' ') + 1;
    return run.out.substr(at, run.out.find('\n', at) - at);
  };
  EXPECT_EQ(lineAt("vec3s").size(), lineAt("grid").size()) << "its cells are below their titles";
  EXPECT_THAT(lineAt("vec3s"), testing::EndsWith(" -"));
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
  EXPECT_THAT(nano.err, AllOf(HasSubstr("grid \"vec3s\" is left out: a .nvdb file"),
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

TEST_F(CarriedFile, WithAHalfGridIsWrittenWithAWarningForOlderVersionsOfOpenVdb) {
  const std::string source = ESVR_SOURCE_DIR "/tests/vdb/openvdb13/half_mask.vdb";
  const auto warningOf = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {source, out(), "-f"});
    EXPECT_EQ(test::vdb2esvr(options).exitCode, 0);
    const auto run = test::esvr2vdb({out(), back(), "-f"});
    EXPECT_EQ(run.exitCode, 0);
    EXPECT_EQ(inspectVdb(back()).grids.front().activeVoxels, 2261u);
    return run.err;
  };
  EXPECT_THAT(warningOf({"--keep", "density"}),
              HasSubstr("\"density\" is a HalfGrid; only OpenVDB 13"));
  EXPECT_EQ(warningOf({"--lossless"}), "");
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
        test::Refusal{{"--size", "1500B"}, 2, "to skip some makes room"},
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
  int carried = 0, vectors = 0;
  for (std::size_t g = 0; g < source.size(); ++g) {
    SCOPED_TRACE(source[g].name);
    if (source[g].isVector) {  // it is carried or converted, whichever takes fewer bytes
      const VectorGrid a = readVector(frame, g), b = readVector(back(), g);
      for (std::size_t c = 0; c < kComponents; ++c)
        EXPECT_EQ(b.components[c].values, a.components[c].values);
      ++vectors;
    } else if (!source[g].skipReason.empty()) {
      EXPECT_EQ(after[g], before[g]);
      ++carried;
    } else {
      EXPECT_EQ(readGrid(back(), source[g].uniqueName).volume.values,
                readGrid(frame, source[g].uniqueName).volume.values);
    }
  }
  EXPECT_EQ(carried, 6);
  EXPECT_EQ(vectors, 2);
}

class Faithful : public testing::Test {
 protected:
  [[nodiscard]] std::string in() const { return folder_ / "in.vdb"; }
  [[nodiscard]] std::string out() const { return folder_ / "out.esvr"; }
  [[nodiscard]] std::string back() const { return folder_ / "back.vdb"; }

  [[nodiscard]] test::ProgramRun convert(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {in(), out(), "--force"});
    return test::vdb2esvr(more);
  }
  /// Converts the input there and back. \return the run of vdb2esvr
  test::ProgramRun throughTheFile(const std::vector<std::string>& options) const {
    auto run = convert(options);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    const auto decode = test::esvr2vdb({out(), back(), "--force"});
    EXPECT_EQ(decode.exitCode, 0) << decode.err;
    return run;
  }
  [[nodiscard]] test::ProgramRun check(const std::string& candidate,
                                       std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"check", in(), candidate});
    return test::runProgram(ESVR_COMPARE, more);
  }
  void expectSameBytes(const std::string& grid) const {
    const std::size_t place = 0;
    ASSERT_EQ(inspectVdb(back()).grids.at(0).name, grid);
    EXPECT_EQ(test::withoutVersion(readCarried(back(), {&place, 1})),
              test::withoutVersion(readCarried(in(), {&place, 1})));
  }

  test::TemporaryFolder folder_;
};

class Inactive : public Faithful {
 protected:
  void SetUp() override {
    test::writeInput(
        in(), {{.voxels = softBall({}), .inactive = {{{20, 0, 0}, 5.0f}, {{0, 0, 100}, 5.5f}}}});
  }
};

TEST_F(Inactive, AreKeptByLossless) {
  const auto run = throughTheFile({"--lossless"});
  EXPECT_THAT(run.out, HasSubstr("carried unchanged, because it has 2 inactive values (5 to 5.5"));
  for (const auto& file : {out(), back()}) {
    const auto checked = check(file, {"--fail-on", "all", "--max-error", "0"});
    EXPECT_EQ(checked.exitCode, 0) << checked.err;
  }
  EXPECT_EQ(readGrid(back(), "density").inactive, readGrid(in(), "density").inactive);
}

TEST_F(Inactive, AreCountedWhereTheyAreGivenUp) {
  const auto run = throughTheFile(
      {"--representation", "voxels", "--psnr", "40", "--report", folder_ / "r.json"});
  EXPECT_THAT(run.out, HasSubstr("density: gives up 2 inactive values (5 to 5.5, first at"));
  EXPECT_THAT(run.out, HasSubstr("--lossless or --keep density keeps them"));
  const auto checked = check(out());
  EXPECT_EQ(checked.exitCode, 0) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr("inactive values that are not the background: 2 inactive "
                                     "values (5 to 5.5"));
  EXPECT_EQ(check(back(), {"--fail-on", "inactive"}).exitCode, 4);
}

TEST_F(Inactive, OfVectorsAreKeptByLossless) {
  const auto plain = [&] {
    test::writeVectorInput(in(), {.voxels = softBall({})});
    return throughTheFile({"--lossless"});
  };
  EXPECT_THAT(plain().out, Not(HasSubstr("inactive")));
  test::writeVectorInput(in(), {.voxels = softBall({}), .inactive = {{{20, 0, 0}, 2.0f}}});
  EXPECT_THAT(throughTheFile({"--lossless"}).out,
              HasSubstr("velocity: carried unchanged, because it has"));
  expectSameBytes("velocity");
}

TEST_F(Inactive, SignsOfALevelSetAreNoReasonToCarryIt) {
  test::writeInput(in(), {{.voxels = test::distances(9), .background = 3.0f, .levelSet = true}});
  EXPECT_THAT(throughTheFile({"--lossless"}).out, Not(HasSubstr("inactive")));
}

TEST_F(Inactive, AreNotSharedByGridsWithTheSameVoxels) {
  const InputGrid density{.voxels = softBall({})};
  InputGrid other = density;
  other.name = "other";
  other.inactive = {{{20, 0, 0}, 5.0f}};
  test::writeInput(in(), {density, other});
  throughTheFile({"--lossless"});
  EXPECT_EQ(readGrid(back(), "density").inactive.count(), 0u);
  EXPECT_EQ(readGrid(back(), "other").inactive.count(), 1u);
}

/// Halfs in a cube of 24^3 voxels, from 0 to the largest value.
std::vector<test::InputVoxel> noise(float largest) {
  std::vector<test::InputVoxel> voxels;
  std::uint32_t state = 1;
  for (int x = 0; x < 24; ++x)
    for (int y = 0; y < 24; ++y)
      for (int z = 0; z < 24; ++z) {
        state = state * 1664525u + 1013904223u;
        const bool inMiddle = x / 6 == 1 && y / 6 == 1 && z / 6 == 1;
        voxels.push_back({{x, y, z}, inMiddle ? largest : largest * float(state >> 8) * 0x1p-24f});
      }
  return voxels;
}

class Halfs : public Faithful {};

TEST_F(Halfs, KeepTheBoundInTheFileThatUsersOpen) {
  test::writeInput(in(), {{.voxels = noise(1.0f), .half = true}});
  const VolumeGrid source = readGrid(in(), "density");
  for (const char* bound : {"0.0001", "0.0003", "0.0004", "0.0007", "0.02"})
    for (const char* topology : {"auto", "exact"}) {
      throughTheFile({"--max-error", bound, "--topology", topology});
      EXPECT_TRUE(inspectVdb(back()).grids.at(0).savedAsHalf);
      EXPECT_LE(largestDifference(source.volume, readGrid(back(), "density").volume),
                std::stod(bound));
    }
}

TEST_F(Halfs, DoNotBecomeLargerThanTheLargest) {
  test::writeInput(in(), {{.voxels = noise(65504.0f), .half = true}});
  const std::vector<std::vector<std::string>> goals{
      {"--representation", "voxels", "--psnr", "20"},
      {"--max-error", "3%"},
      {"--lossless"},
      {"--count", "20", "--iterations", "20", "--representation", "ellipsoids"}};
  for (const auto& goal : goals) {
    throughTheFile(goal);
    EXPECT_TRUE(inspectVdb(back()).grids.at(0).savedAsHalf);
    const ValueRange range = activeRange(readGrid(back(), "density").volume);
    EXPECT_LE(range.max, 65504.0f);
  }
}

struct Refused {
  const char* name;
  InputGrid grid;
  const char* reason;
};
std::ostream& operator<<(std::ostream& out, const Refused& refused) { return out << refused.name; }

class WayOut : public Faithful, public testing::WithParamInterface<Refused> {};

TEST_P(WayOut, IsToldAndCarriesTheGrid) {
  test::writeInput(in(), {GetParam().grid});
  for (const auto& goal :
       {std::vector<std::string>{}, {"--lossless"}, {"--max-error", "1%"}, {"--size", "9KB"}}) {
    const auto run = convert(goal);
    EXPECT_EQ(run.exitCode, 3);
    EXPECT_THAT(run.err,
                AllOf(HasSubstr(GetParam().reason), HasSubstr("--keep 'my grid' carries")));
  }
  throughTheFile({"--keep", "my grid"});
  expectSameBytes("my grid");
}

constexpr std::int32_t kFar = 1'500'000'000;

INSTANTIATE_TEST_SUITE_P(
    All, WayOut,
    testing::Values(
        Refused{
            "nan", {.name = "my grid", .voxels = {{{0, 0, 0}, kNan}, {{1, 0, 0}, 1.0f}}}, "NaN"},
        Refused{"background",
                {.name = "my grid", .voxels = softBall({}), .background = kNan},
                "background"},
        Refused{"infiniteBackground",
                {.name = "my grid",
                 .voxels = softBall({}),
                 .background = std::numeric_limits<float>::infinity()},
                "background"},
        Refused{"far",
                {.name = "my grid", .voxels = {{{-kFar, 0, 0}, 1.0f}, {{kFar, 0, 0}, 1.0f}}},
                "2^31"}),
    [](const auto& refused) { return std::string(refused.param.name); });

}  // namespace
}  // namespace esvr
