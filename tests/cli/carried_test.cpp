// Plan: grids that cannot be fitted, that are empty or that the user wants unchanged come back bit for
// bit, and whatever else a grid holds is kept, or the program says that it is not and how to keep it.
// Every promise is checked on the .vdb file that a user gets in the end.
//
// Files with NaN and infinite voxels go through the converters as users run them. They are refused with the option
// that keeps them, and with it they come back where they were, as floats, halfs and doubles, as components of vectors, in
// level sets, in .vdb and .nvdb files, in twins and in sequences. Reports and lists count them, comparisons leave them
// out, and pictures show them as empty.

#include <openvdb/io/File.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "cli/conversion.h"
#include "esvr/quantised.h"
#include "support/machine.h"
#include "support/non_finite.h"
#include "vdb/open_vdb.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// A folder with a file of the grids bool, int32, vec3s, points, density, empty and density.
class CarriedFile : public Conversion {
 protected:
  void SetUp() override {
    writeMixedInput(
        in(), {{.voxels = softBall({})}, {.name = "empty"}, {.voxels = softBall({30, 0, 0})}});
  }
  void fit(const Words& more = {}) const { succeeded(fitQuickly(more)); }
};

TEST_F(CarriedFile, GivesAllGridsBackInOrderAndThoseThatAreNotFittedBitForBit) {
  fit();
  convertBack();
  EXPECT_EQ(namesIn(back()), namesIn(in()));
  EXPECT_EQ(carriedIn(back(), {0, 1, 2, 3, 5}), carriedIn(in(), {0, 1, 2, 3, 5}));
  EXPECT_GT(readGrid(back(), "density[1]").descriptor.metadata.size(), 0u);
}

TEST_F(CarriedFile, KeepsANamedGridUnchanged) {
  fit("--keep density[1]");
  EXPECT_EQ(readEsvr(out()).grids.size(), 1u);
  convertBack();
  EXPECT_EQ(namesIn(back()), namesIn(in()));
  EXPECT_EQ(carriedIn(back(), {6}), carriedIn(in(), {6}));
}

TEST_F(CarriedFile, KeepsANamedGridBesideThoseOfTheOptionGrid) {
  fit("-g density[0] --keep vec3s");
  convertBack();
  EXPECT_THAT(namesIn(back()), ElementsAre("vec3s", "density"));
}

TEST_F(CarriedFile, LeavesOutTheGridsThatAreNamedBySkip) {
  EXPECT_THAT(succeeded(fitQuickly("--skip points --skip density[0]")).out,
              Says("points: left out", "5 of 7 grids"));
  convertBack();
  EXPECT_THAT(namesIn(back()), ElementsAre("bool", "int32", "vec3s", "empty", "density"));
}

TEST_F(CarriedFile, WithNothingToFitIsConvertedWithAWarning) {
  EXPECT_THAT(succeeded(fitQuickly("-g int32 -g empty")).err,
              HasSubstr("carried grids only (2 of 2 grids carried unchanged)"));
  convertBack();
  EXPECT_EQ(carriedIn(back()), carriedIn(in(), {1, 5}));
}

TEST_F(CarriedFile, IsComparedWhereGridsAreNotCarried) {
  succeeded(fitQuickly("-g int32 -g empty"));
  const auto run = succeeded(esvr2vdb({out(), back(), "--reference", in()}));
  EXPECT_THAT(run.err, Says("\"int32\" was carried unchanged, and is not compared", "\"empty\""));
  EXPECT_EQ(run.out, "");
}

TEST_F(CarriedFile, IsSummarisedAndReported) {
  EXPECT_THAT(succeeded(quickFit(in(), out(),
                                 {"--skip", "bool", "--report", at("r.json"), "--keep", "points"}))
                  .out,
              Says("int32: carried unchanged, because its values are of type",
                   "empty: carried unchanged, because it has no active voxel",
                   "points: carried unchanged, because --keep names it",
                   "bool: left out, because --skip names it"));
  const auto report = Json::parse(readText(at("r.json")));
  ASSERT_EQ(report["carried"].size(), 4u);
  EXPECT_EQ(report["carried"][0]["name"], "int32");
  EXPECT_GT(report["carried"][0]["bytes"], 0);
  EXPECT_EQ(report["carried"][0]["source_bytes"], inspectVdb(in()).grids[1].storedBytes);
  ASSERT_EQ(report["skipped"].size(), 1u);
  EXPECT_EQ(report["skipped"][0]["name"], "bool");
  EXPECT_EQ(report["asked"]["skip"], Json::array({"bool"}));
}

TEST_F(CarriedFile, ListsItsCarriedGridsInOrder) {
  fit();
  const auto run = succeeded(esvr2vdb({"--list", "-v", out()}));
  EXPECT_LT(run.out.find("vec3s"), run.out.find("density[0]"));
  EXPECT_THAT(run.out, Says("carried bytes", "int32: carried unchanged, Tree_int32_5_4_3"));
  const auto lineAt = [&](const std::string& begin) {
    const auto at = run.out.find('\n' + begin + ' ') + 1;
    return run.out.substr(at, run.out.find('\n', at) - at);
  };
  EXPECT_EQ(lineAt("vec3s").size(), lineAt("grid").size()) << "its cells are below their titles";
  EXPECT_THAT(lineAt("vec3s"), testing::EndsWith(" -"));
}

TEST_F(CarriedFile, GivesBackTheCarriedGridsThatAreNamed) {
  fit();
  convertBack("-g density[1] -g vec3s");
  EXPECT_THAT(namesIn(back()), ElementsAre("vec3s", "density"));
  EXPECT_EQ(carriedIn(back(), {0}), carriedIn(in(), {2}));
}

TEST_F(CarriedFile, SaysWhichGridsNanoVdbAndPartsCannotHold) {
  fit();
  EXPECT_THAT(succeeded(esvr2vdb({out(), at("back.nvdb")})).err,
              Says("grid \"vec3s\" is left out: a .nvdb file", Not(HasSubstr("density[0]"))));
  EXPECT_THAT(succeeded(esvr2vdb({out(), back(), "--bbox", "0,0,0,7,7,7"})).err,
              HasSubstr("grid \"vec3s\" is left out: --lod"));
  EXPECT_THAT(namesIn(back()), ElementsAre("density[0]", "density[1]"));
  for (const Words& more : {Words{at("no.nvdb")}, {at("no.vdb"), "--lod", "1"}})
    EXPECT_THAT(esvr2vdb(joined({out(), "-g", "vec3s"}, more)),
                Fails(2, "grid \"vec3s\" cannot be written"));
}

TEST_F(CarriedFile, WithAHalfGridIsWrittenWithAWarningForOlderVersionsOfOpenVdb) {
  const std::string source = ESVR_SOURCE_DIR "/tests/vdb/openvdb13/half_mask.vdb";
  const auto warningOf = [&](const Words& options) {
    succeeded(vdb2esvr(joined({source, out(), "-f"}, options)));
    const auto run = succeeded(esvr2vdb({out(), back(), "-f"}));
    EXPECT_EQ(inspectVdb(back()).grids.front().activeVoxels, 2261u);
    return run.err;
  };
  EXPECT_THAT(warningOf("--keep density"), HasSubstr("\"density\" is a HalfGrid; only OpenVDB 13"));
  EXPECT_EQ(warningOf("--lossless"), "");
}

/// A file with grids of metadata of this size.
void writeLarge(const std::string& path, int count, std::size_t bytes) {
  openvdb::GridPtrVec grids;
  for (int i = 0; i < count; ++i) {
    grids.push_back(emptyGrid("Tree_int32_5_4_3", "large"));
    grids.back()->insertMeta("text", openvdb::StringMetadata(std::string(bytes, 'x')));
  }
  openvdb::io::File(path).write(grids);
}

TEST_F(CarriedFile, SlowWithAGridLargerThanTheMemoryIsKeptInAFile) {
  writeLarge(in(), 1, 50'000'000);
  const Words memory{"--max-memory", "40MB", "--scratch", folder_ / "."};
  fit(memory);
  convertBack(memory);
  EXPECT_EQ(carriedIn(back()), carriedIn(in()));
}

TEST_F(CarriedFile, WithGridsThatTakeMoreMemoryThanAllowedIsRefusedWithTheirName) {
  writeLarge(in(), 5, 2'000'000);  // each of them is within a quarter of the limit
  EXPECT_THAT(fitQuickly("--max-memory 9MB"), Fails(5, "in.vdb", "large", "10 MB"));
}

TEST_F(CarriedFile, OfASequenceIsConvertedOneByOneWhereMemoryIsShort) {
  for (const char* frame : {"in.1.vdb", "in.2.vdb", "in.3.vdb"})
    writeLarge(at(frame), 5, 2'000'000);
  const auto codeWithin = [&](const char* limit) {
    return quickFit(at("in.@.vdb"), at("out.@.esvr"),
                    {"--max-memory", limit, "--threads", "3", "--force"})
        .exitCode;
  };
  EXPECT_EQ(codeWithin("12MB"), 0) << "a third of it is too little for a frame";
  EXPECT_EQ(codeWithin("9MB"), 5);
}

TEST_F(CarriedFile, SlowWithFiftyMegabytesOfFileMetadataComesBack) {
  openvdb::MetaMap metadata;
  metadata.insertMeta("text", openvdb::StringMetadata(std::string(50'000'000, 'x')));
  openvdb::io::File(in()).write({emptyGrid("Tree_int32_5_4_3", "a")}, metadata);
  fit("--max-memory 8GB");
  convertBack("--max-memory 8GB");
  EXPECT_EQ(stringValue(inspectVdb(back()).metadata, "text").size(), 50'000'000u);
  EXPECT_THAT(esvr2vdb({out(), at("no.vdb"), "--max-memory", "100MB"}), Fails(5, "file metadata"));
}

TEST_F(CarriedFile, OfNanoVdbIsRefusedUnlessTheGridIsLeftOut) {
  saveNano(at("in.nvdb"), {emptyGrid("Tree_float_5_4_3", "none")});
  EXPECT_THAT(quickFit(at("in.nvdb"), out()),
              Fails(3, "\"none\" can be neither fitted (it has no active voxel)", "--skip"));
  EXPECT_THAT(quickFit(at("in.nvdb"), out(), "--skip none"), Fails(3));
}

class RefusedCarrying : public CarriedFile, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedCarrying, IsExplained) {
  GetParam().expectOf(vdb2esvr(joined({in(), out()}, GetParam().arguments)));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedCarrying,
    testing::Values(Refusal{"--skip points -g points", 2, "-g both name grid \"points\""},
                    Refusal{"--skip points --keep points", 2, "--keep both name"},
                    Refusal{"--keep fuel", 3, "no grid \"fuel\""},
                    Refusal{"--skip fuel", 3, "no grid \"fuel\""},
                    Refusal{"--size 1500B", 2, "to skip some makes room"},
                    Refusal{"--skip bool --skip int32 --skip vec3s --skip points --skip density[0] "
                            "--skip density[1] --skip empty",
                            3, "all grids of the file are left out"}));

TEST_F(CarriedFile, RealFileOfTwentyFourGridsComesBackWithoutLoss) {
  ESVR_NEEDS_DATA();
  const std::string frame = std::string(ESVR_DATA_DIR) + "/sequence/gas_0001.vdb";
  succeeded(vdb2esvr({frame, out(), "--lossless"}));
  convertBack();
  const auto source = inspectVdb(frame).grids;
  ASSERT_EQ(namesIn(back()), namesIn(frame));
  const auto before = carriedIn(frame), after = carriedIn(back());
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

class Faithful : public Conversion {
 protected:
  void expectSameBytes(const std::string& grid) const {
    const std::size_t place = 0;
    ASSERT_EQ(inspectVdb(back()).grids.at(0).name, grid);
    EXPECT_EQ(withoutVersion(readCarried(back(), {&place, 1})),
              withoutVersion(readCarried(in(), {&place, 1})));
  }
};

class Inactive : public Faithful {
 protected:
  void SetUp() override {
    writeInput(in(),
               {{.voxels = softBall({}), .inactive = {{{20, 0, 0}, 5.0f}, {{0, 0, 100}, 5.5f}}}});
  }
};

TEST_F(Inactive, AreKeptByLossless) {
  EXPECT_THAT(thereAndBack("--lossless").out,
              HasSubstr("carried unchanged, because it has 2 inactive values (5 to 5.5"));
  for (const auto& file : {out(), back()}) succeeded(check(file, "--fail-on all --max-error 0"));
  EXPECT_EQ(readGrid(back(), "density").inactive, readGrid(in(), "density").inactive);
}

TEST_F(Inactive, AreCountedWhereTheyAreGivenUp) {
  const auto run =
      thereAndBack({"--representation", "voxels", "--psnr", "40", "--report", folder_ / "r.json"});
  EXPECT_THAT(run.out, HasSubstr("density: gives up 2 inactive values (5 to 5.5, first at"));
  EXPECT_THAT(run.out, HasSubstr("--lossless or --keep density keeps them"));
  EXPECT_THAT(succeeded(check(out())).out,
              HasSubstr("inactive values that are not the background: 2 inactive "
                        "values (5 to 5.5"));
  EXPECT_THAT(check(back(), "--fail-on inactive"), Fails(4));
}

TEST_F(Inactive, OfVectorsAreKeptByLossless) {
  const auto plain = [&] {
    writeVectorInput(in(), {.voxels = softBall({})});
    return thereAndBack("--lossless");
  };
  EXPECT_THAT(plain().out, Not(HasSubstr("inactive")));
  writeVectorInput(in(), {.voxels = softBall({}), .inactive = {{{20, 0, 0}, 2.0f}}});
  EXPECT_THAT(thereAndBack("--lossless").out,
              HasSubstr("velocity: carried unchanged, because it has"));
  expectSameBytes("velocity");
}

TEST_F(Inactive, SignsOfALevelSetAreNoReasonToCarryIt) {
  writeInput(in(), {{.voxels = distances(9), .background = 3.0f, .levelSet = true}});
  EXPECT_THAT(thereAndBack("--lossless").out, Not(HasSubstr("inactive")));
}

TEST_F(Inactive, AreNotSharedByGridsWithTheSameVoxels) {
  const InputGrid density{.voxels = softBall({})};
  InputGrid other = density;
  other.name = "other";
  other.inactive = {{{20, 0, 0}, 5.0f}};
  writeInput(in(), {density, other});
  thereAndBack("--lossless");
  EXPECT_EQ(readGrid(back(), "density").inactive.count(), 0u);
  EXPECT_EQ(readGrid(back(), "other").inactive.count(), 1u);
}

/// Halfs in a cube of 24^3 voxels, from 0 to the largest value.
std::vector<InputVoxel> noise(float largest) {
  std::vector<InputVoxel> voxels;
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
  writeInput(in(), {{.voxels = noise(1.0f), .half = true}});
  const VolumeGrid source = readGrid(in(), "density");
  for (const char* bound : {"0.0001", "0.0003", "0.0004", "0.0007", "0.02"})
    for (const char* topology : {"auto", "exact"}) {
      thereAndBack({"--max-error", bound, "--topology", topology});
      EXPECT_TRUE(inspectVdb(back()).grids.at(0).savedAsHalf);
      EXPECT_LE(largestDifference(source.volume, readGrid(back(), "density").volume),
                std::stod(bound));
    }
}

TEST_F(Halfs, DoNotBecomeLargerThanTheLargest) {
  writeInput(in(), {{.voxels = noise(65504.0f), .half = true}});
  const std::vector<Words> goals{
      {"--representation", "voxels", "--psnr", "20"},
      {"--max-error", "3%"},
      {"--lossless"},
      {"--count", "20", "--iterations", "20", "--representation", "ellipsoids"}};
  for (const auto& goal : goals) {
    thereAndBack(goal);
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
  writeInput(in(), {GetParam().grid});
  for (const auto& goal : {Words{}, {"--lossless"}, {"--max-error", "1%"}, {"--size", "9KB"}})
    EXPECT_THAT(convert(goal), Fails(3, GetParam().reason, "--keep 'my grid' carries"));
  thereAndBack({"--keep", "my grid"});
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

// ---- Voxels that are not finite

/// A ball with voxels that are not finite in it and beside it.
InputGrid damagedBall(const std::string& name = "density") {
  InputGrid grid{.name = name, .voxels = softBall({})};
  for (InputVoxel& voxel : grid.voxels)
    if ((voxel.at.x + 3 * voxel.at.y + 5 * voxel.at.z) % 11 == 0) voxel.value = kNan;
  grid.voxels.push_back({{40, 0, 0}, kInf});
  grid.voxels.push_back({{41, 0, 0}, -kInf});
  return grid;
}

const ReadOptions kKeep{.nonFinite = NonFinite::kKeep};

class NonFiniteFile : public Vdb2Esvr {
 protected:
  void convertKept(const Words& options) const {
    succeeded(convert(joined("--nonfinite keep", options)));
  }
  void decode(const std::string& to) const { succeeded(esvr2vdb({out(), to, "--force"})); }
};

/// Counts the voxels that are not finite in the first volume. The test fails if the second has others.
std::uint64_t expectSame(const SparseVolume& a, const SparseVolume& b) {
  const VolumeMetrics m = compareVolumes(a, b);
  EXPECT_GT(m.nonFinite, 0u);
  return m.nonFinite;
}

TEST_F(NonFiniteFile, isRefusedWithTheOptionThatKeepsIt) {
  writeInput(in(), {damagedBall()});
  EXPECT_THAT(fitQuickly(), Fails(3, "--nonfinite keep stores where they are"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(NonFiniteFile, comesBackInEveryFormAndOutput) {
  for (const bool isHalf : {false, true}) {
    InputGrid grid = damagedBall();
    grid.half = isHalf;
    writeInput(in(), {grid});
    const SparseVolume source = readGrid(in(), 0, kKeep).volume;
    for (const Words& goal : {Words{"--count", "30", "--iterations", "40"},
                              {"--psnr", "40", "--representation", "voxels"},
                              {"--max-error", "0.01"},
                              {"--max-relative-error", "1%"},
                              {"--lossless"},
                              {}}) {
      convertKept(goal);
      for (const char* name : {"back.vdb", "back.nvdb"}) {
        decode(folder_ / name);
        const VolumeGrid made = readGrid(folder_ / name, 0, kKeep);
        EXPECT_EQ(expectSame(source, made.volume), expectSame(source, source));
      }
    }
    EXPECT_EQ(inspectVdb(back()).grids.front().savedAsHalf, isHalf);
  }
}

TEST_F(NonFiniteFile, isCountedByTheReportAndTheList) {
  writeInput(in(), {damagedBall()});
  const std::string report = folder_ / "report.json";
  convertKept({"--max-error", "0.01", "--report", report});
  std::ifstream stream(report);
  const auto kept = Json::parse(stream)["grids"][0]["source"]["nonfinite_kept"];
  EXPECT_GT(kept["nan"], 20);
  EXPECT_EQ(kept["plus_infinity"], 1);
  EXPECT_EQ(kept["minus_infinity"], 1);
  EXPECT_GT(kept["bytes"], 20);
  EXPECT_THAT(
      esvr2vdb({"--list", out(), "-v"}).out,
      Says("not finite", "non-finite voxels", "NaN and 1 +infinity and 1 -infinity voxels"));
}

TEST_F(NonFiniteFile, isComparedWithoutThem) {
  writeInput(in(), {damagedBall()});
  convertKept("--max-error 0.01");
  succeeded(esvr2vdb({out(), back(), "--reference", in()}));
  succeeded(compare("check", {in(), out(), "--max-error", "0.01"}));
  InputGrid other = damagedBall();
  other.voxels.back().value = 0.5f;
  const std::string changed = folder_ / "changed.vdb";
  writeInput(changed, {other});
  const auto check = compare("check", {in(), changed});
  EXPECT_NE(check.exitCode, 0);
  EXPECT_THAT(check.out + check.err,
              HasSubstr("(41, 0, 0) is not finite: it is minus infinity in the reference"));
}

TEST_F(NonFiniteFile, keepsComponentsOfVectors) {
  // An infinity times the scales 1, -0.5 and 0 makes an infinity, a minus infinity and NaN.
  InputVectors vectors{.voxels = softBall({})};
  vectors.voxels[7].value = kInf;
  writeVectorInput(in(), vectors);
  for (const bool asDouble : {false, true}) {
    vectors.asDouble = asDouble;
    writeVectorInput(in(), vectors);
    convertKept("--max-error 0.01 --representation voxels");
    decode(back());
    const VectorVolume a = readVector(in(), 0, kKeep).components,
                       b = readVector(back(), 0, kKeep).components;
    const Coord at = vectors.voxels[7].at;
    for (const VectorVolume& made : {a, b}) {
      EXPECT_EQ(valueAt(made[0], at), kInf);
      EXPECT_EQ(valueAt(made[1], at), -kInf);
      EXPECT_TRUE(std::isnan(valueAt(made[2], at)));
    }
    EXPECT_EQ(compareVectors(a, b).components[0].nonFinite, 1u);
  }
}

/// Carried vectors are read again for a .nvdb file, which gets floats.
TEST_F(NonFiniteFile, keepsCarriedVectorsInNanoVdb) {
  InputVectors vectors{.voxels = softBall({}), .asDouble = true};
  vectors.voxels[7].value = kInf;
  writeVectorInput(in(), vectors);
  succeeded(vdb2esvr({in(), out(), "--lossless"}));
  const std::string nano = at("back.nvdb");
  EXPECT_THAT(succeeded(esvr2vdb({out(), nano})).err, HasSubstr("rounded to floats"));
  EXPECT_EQ(valueAt(readVector(nano, 0, kKeep).components[1], vectors.voxels[7].at), -kInf);
}

TEST_F(NonFiniteFile, isSharedByTwins) {
  writeInput(in(), {damagedBall(), damagedBall("copy")});
  convertKept("--max-error 0.01");
  const EsvrFile file = readEsvr(out());
  ASSERT_EQ(file.grids.size(), 2u);
  EXPECT_EQ(file.grids[0].nonFiniteVoxels, file.grids[1].nonFiniteVoxels);
  const auto summary = inspectEsvr(std::filesystem::path(out()));
  int shared = 0;
  for (const SectionSummary& section : summary.sections)
    shared += section.kind == "non-finite voxels" && section.sharedWith.has_value();
  EXPECT_EQ(shared, 1);
}

TEST_F(NonFiniteFile, ofALevelSetKeepsItsSides) {
  InputGrid band{.background = 3.0f, .levelSet = true};
  for (const InputVoxel& voxel : distances(11))
    if (std::abs(voxel.value) < 3.0f)
      band.voxels.push_back(voxel);
    else if (voxel.value < 0.0f)
      band.inactive.push_back({voxel.at, -3.0f});
  writeInput(in(), {band});
  const VolumeGrid clean = readGrid(in(), 0);
  ASSERT_LT(valueAt(clean.volume, {}), 0.0f);
  VolumeGrid source = clean;
  for (float& value : source.volume.values)
    if (value < -2.0f && value > -3.0f) value = kNan;  // the voxels next to the inside
  std::filesystem::remove(in());
  writeGrids(in(), {}, std::vector<VolumeGrid>{source});
  for (const Words& goal :
       {Words{"--lossless"}, {"--representation", "ellipsoids", "--psnr", "35"}}) {
    convertKept(goal);
    decode(back());
    const SparseVolume made = readGrid(back(), 0, kKeep).volume;
    // They have no sign. All others have that of the band without them.
    EXPECT_EQ(compareSigns(clean.volume, made).voxels, expectSame(source.volume, made));
  }
}

TEST_F(NonFiniteFile, ofASequenceComesBackInEachFrame) {
  for (int frame = 1; frame <= 3; ++frame) {
    InputGrid grid = damagedBall();
    for (InputVoxel& voxel : grid.voxels) voxel.value *= 1.0f - 0.1f * float(frame);
    writeInput(folder_ / ("in.000" + std::to_string(frame) + ".vdb"), {grid});
  }
  succeeded(
      vdb2esvr({folder_ / "in.####.vdb", out(), "--nonfinite", "keep", "--max-error", "0.01"}));
  succeeded(esvr2vdb({out(), folder_ / "back.####.vdb"}));
  for (const char* frame : {".0001.vdb", ".0002.vdb", ".0003.vdb"}) {
    const VolumeMetrics m =
        compareVolumes(readGrid(folder_ / ("in" + std::string(frame)), 0, kKeep).volume,
                       readGrid(folder_ / ("back" + std::string(frame)), 0, kKeep).volume);
    EXPECT_GT(m.nonFinite, 20u);
    EXPECT_LE(m.maxError, 0.01);
  }
}

TEST_F(NonFiniteFile, isDrawnAsIfTheyWereEmpty) {
  InputGrid empty = damagedBall();
  std::erase_if(empty.voxels, [](const InputVoxel& voxel) { return !std::isfinite(voxel.value); });
  const auto picture = [&](const std::string& from, const std::string& name) {
    const std::string to = folder_ / name;
    succeeded(
        runProgram(ESVR_RENDER, {from, to, "--resolution", "32x32", "--device", "cpu", "--eye",
                                 "40,30,20", "--center", "0,0,0", "--range", "0,1"}));
    std::ifstream stream(to, std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(stream), {});
    return bytes.substr(bytes.find("IDAT"));  // the text before it has the command line
  };
  writeInput(in(), {damagedBall()});
  convertKept("--lossless");
  const std::string ofEsvr = picture(out(), "esvr.png"), ofVdb = picture(in(), "vdb.png");
  writeInput(in(), {empty});
  const std::string ofEmpty = picture(in(), "empty.png");
  EXPECT_TRUE(ofVdb == ofEmpty);
  EXPECT_TRUE(ofEsvr == ofEmpty);
}

}  // namespace

}  // namespace esvr::test
