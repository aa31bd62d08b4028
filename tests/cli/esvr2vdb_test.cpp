// Plan: esvr2vdb is run as a separate process. The tests check its jobs, and the exit codes and
// messages of refused input; a failure leaves no file behind. Each kind of extreme grid is fitted,
// written and decoded by the programs. Name, class, transform, metadata, background and `creator`
// come back exactly. The PSNR of the voxels is high enough to show that the values are in the
// right places; it is low because the fits are short.
//
// Esvr2vdb writes grids at other resolutions. The voxels and the transform that other programs read are those of the
// library (tests/encode/resolution_test.cpp), for .vdb and .nvdb files, vectors and parts of files; auto keeps to the
// memory and says what it chose; options that contradict each other are refused.

#include <openvdb/io/File.h>

#include <algorithm>
#include <cstdio>

#include "cli/conversion.h"
#include "esvr/resolution.h"
#include "fit/volumes.h"
#include "vdb/open_vdb.h"

namespace esvr::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;

/// A folder with a source file of two grids and a fit of it.
class Esvr2Vdb : public FolderTest {
 protected:
  void SetUp() override {
    writeInput(source(),
               {{.voxels = softBall({})},
                {.name = "heat", .voxels = softBall({40, 0, 0}, 2.0f, 1.0f), .background = 1.0f}});
    succeeded(quickFit(source(), in()));
  }
  [[nodiscard]] std::string source() const { return at("source.vdb"); }
  [[nodiscard]] std::string in() const { return at("in.esvr"); }
  [[nodiscard]] std::string out() const { return at("out.vdb"); }
  [[nodiscard]] bool outIsThere() const { return std::filesystem::exists(out()); }
};

TEST_F(Esvr2Vdb, writesAllGridsQuietly) {
  EXPECT_THAT(succeeded(esvr2vdb({in(), out()})).out, IsEmpty());
  const auto grids = inspectVdb(out()).grids;
  ASSERT_EQ(grids.size(), 2u);
  EXPECT_EQ(grids[0].name, "density");
  EXPECT_EQ(grids[1].name, "heat");
}

TEST_F(Esvr2Vdb, writesTheGridsThatAreNamedOnly) {
  succeeded(esvr2vdb({in(), out(), "-g", "heat"}));
  const auto grids = inspectVdb(out()).grids;
  ASSERT_EQ(grids.size(), 1u);
  EXPECT_EQ(grids[0].name, "heat");
}

TEST_F(Esvr2Vdb, writesNanoVdbByTheEnding) {
  const std::string nano = folder_ / "out.nvdb";
  succeeded(esvr2vdb({in(), nano}));
  EXPECT_EQ(inspectVdb(nano).format, "NanoVDB");
  succeeded(esvr2vdb({in(), out()}));
  EXPECT_EQ(readGrid(nano, "heat").volume.values, readGrid(out(), "heat").volume.values);
}

TEST_F(Esvr2Vdb, savesAsHalfWhereAsked) {
  succeeded(esvr2vdb({in(), out(), "--half", "on"}));
  EXPECT_TRUE(inspectVdb(out()).grids[0].savedAsHalf);
  succeeded(esvr2vdb({in(), out(), "--force"}));
  EXPECT_FALSE(inspectVdb(out()).grids[0].savedAsHalf) << "the source was not";
}

/// The numbers of the message "read N of M bytes" on stderr.
struct BytesRead {
  unsigned long read = 0, whole = 0;
};
BytesRead bytesRead(const std::string& err) {
  BytesRead bytes;
  const auto at = err.find("read ");
  if (at != std::string::npos)
    std::sscanf(err.c_str() + at, "read %lu of %lu bytes", &bytes.read, &bytes.whole);
  return bytes;
}

TEST_F(Esvr2Vdb, writesAPartOfTheVoxelsWithoutReadingTheRest) {
  // In the compact layout, small sections are read together.
  succeeded(quickFit(source(), in(), "--share off --force"));
  // "heat" lies 40 voxels away from "density", so its ellipsoids cannot reach the box.
  const auto run = succeeded(esvr2vdb({in(), out(), "--bbox", "-4,-4,-4,3,7,7"}));
  const Box box = inspectVdb(out()).grids[0].activeBox;
  EXPECT_FALSE(box.empty());
  EXPECT_TRUE((Box{{-4, -4, -4}, {3, 7, 7}}.contains(box.min)));
  EXPECT_TRUE((Box{{-4, -4, -4}, {3, 7, 7}}.contains(box.max)));
  EXPECT_EQ(inspectVdb(out()).grids[1].activeVoxels, 0u);
  const BytesRead bytes = bytesRead(run.err);
  EXPECT_EQ(bytes.whole, std::filesystem::file_size(in()));
  EXPECT_GT(bytes.read, 0u);
  EXPECT_LT(bytes.read + 100, bytes.whole);
  const SparseVolume part = readGrid(out(), "density").volume;
  succeeded(esvr2vdb({in(), out(), "--force"}));
  const SparseVolume whole = readGrid(out(), "density").volume;
  for (int x = -4; x <= 3; ++x) EXPECT_EQ(valueAt(part, {x, 1, 2}), valueAt(whole, {x, 1, 2}));
}

TEST_F(Esvr2Vdb, writesTheHeaviestEllipsoidsOnly) {
  succeeded(esvr2vdb({in(), out(), "-g", "density", "--max-ellipsoids", "1"}));
  const auto few = inspectVdb(out()).grids[0].activeVoxels;
  succeeded(esvr2vdb({in(), out(), "-g", "density", "--lod", "1", "-f"}));
  EXPECT_LT(few, inspectVdb(out()).grids[0].activeVoxels) << "so small a file has one layer";
}

TEST_F(Esvr2Vdb, hasFewerActiveVoxelsAtAHigherThreshold) {
  succeeded(esvr2vdb({in(), out(), "--threshold", "0"}));
  const auto many = inspectVdb(out()).grids[0].activeVoxels;
  succeeded(esvr2vdb({in(), out(), "--threshold", "0.5", "--force"}));
  const auto few = inspectVdb(out()).grids[0].activeVoxels;
  EXPECT_LT(few, many);
  EXPECT_GT(few, 0u);
}

TEST_F(Esvr2Vdb, saysSoWhereAThresholdLeavesNothing) {
  EXPECT_THAT(succeeded(esvr2vdb({in(), out(), "-g", "density", "--threshold", "100"})).err,
              HasSubstr("comes back without an active voxel"));
}

TEST_F(Vdb2Esvr, warnsOfGridsThatCannotComeBackInPart) {
  succeeded(vdb2esvr({in(), out(), "--lossless"}));
  for (const Words& part : {Words{"--lod", "1"}, {"--max-ellipsoids", "3"}})
    EXPECT_THAT(succeeded(esvr2vdb(joined({out(), back(), "--force"}, part))).err,
                HasSubstr("grid \"density\" comes back whole: it has voxels"));
  succeeded(fitQuickly("--force"));
  EXPECT_THAT(succeeded(esvr2vdb({out(), back(), "--force", "--lod", "1"})).err,
              HasSubstr("grid \"density\" comes back whole: it has a single layer"));
  writeInput(in(), {{.voxels = cloud(20)}});
  succeeded(vdb2esvr({in(), out(), "--force", "--count", "2500", "--iterations", "20",
                      "--representation", "ellipsoids"}));
  const auto first = succeeded(esvr2vdb({out(), back(), "--force", "--lod", "1"}));
  EXPECT_THAT(first.err, AllOf(HasSubstr("read "), Not(HasSubstr("comes back whole"))))
      << "the first of several layers is not the whole grid";
}

/// Where a surface has a hole, no flood fill can tell the inside from the outside. Leaves with active voxels keep it.
TEST_F(Vdb2Esvr, warnsWhereTheInsideOfALevelSetIsLost) {
  const auto write = [&](int end, bool isInEmptySpace = false) {
    InputGrid grid{.background = 3.0f, .levelSet = true};
    for (const InputVoxel& voxel : distances(12))
      if (std::abs(voxel.value) < 3.0f && voxel.at.x < end)
        grid.voxels.push_back(voxel);
      else if (voxel.value < 0.0f)
        grid.inactive.push_back({voxel.at, -3.0f});
    if (isInEmptySpace) grid.inactive.push_back({{40, 0, 0}, -3.0f});
    std::filesystem::remove(in());
    writeInput(in(), {grid});
    return succeeded(vdb2esvr({in(), out(), "--force", "--preset", "draft"})).err;
  };
  EXPECT_EQ(write(13), "");
  EXPECT_EQ(write(1), "");
  const auto signErrors = [&] {
    succeeded(esvr2vdb({out(), back(), "--force"}));
    return compareSigns(readGrid(in(), "density").volume, readGrid(back(), "density").volume)
        .voxels;
  };
  EXPECT_EQ(signErrors(), 0u);
  EXPECT_THAT(write(1, true), HasSubstr("grid \"density\": the signs of inactive voxels inside"));
  EXPECT_EQ(signErrors(), 0u) << "where voxels are";
}

TEST_F(Vdb2Esvr, warnsWhereNoVoxelIsInTheBox) {
  EXPECT_THAT(succeeded(fitQuickly("--box 900,900,900,910,910,910")).err,
              HasSubstr("grid \"density\" has no active voxel in the box"));
  EXPECT_EQ(succeeded(fitQuickly("--force --box 0,0,0,910,910,910")).err, "");
}

TEST_F(Esvr2Vdb, printsTheErrorAgainstAReference) {
  const auto run = succeeded(esvr2vdb({in(), out(), "--reference", source()}));
  for (const char* word : {"PSNR box", "PSNR T 0.5", "SSIM", "IoU", "mass ref", "density", "heat"})
    EXPECT_THAT(run.out, HasSubstr(word));
}

TEST_F(Esvr2Vdb, wantsEveryGridInTheReferenceBeforeItWrites) {
  writeInput(folder_ / "other.vdb", {{.voxels = softBall({})}});
  EXPECT_THAT(esvr2vdb({in(), out(), "--reference", folder_ / "other.vdb"}),
              Fails(3, "other.vdb", "heat"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Esvr2Vdb, listsGridsAndSections) {
  const auto run = succeeded(esvr2vdb({"--list", in()}));
  for (const char* word : {"density", "heat", "fog volume", "threshold", "ellipsoids"})
    EXPECT_THAT(run.out, HasSubstr(word));
  EXPECT_THAT(esvr2vdb({"--list", in(), "-v"}).out, HasSubstr("creator"));
}

TEST_F(Esvr2Vdb, listsTheGridsOfAVdb) {
  succeeded(esvr2vdb({in(), folder_ / "out.nvdb"}));
  for (const std::string& file : {source(), std::string(folder_ / "out.nvdb")}) {
    const auto run = succeeded(esvr2vdb({"--list", file}));
    for (const char* word : {"density", "heat", "fog volume", "float", "active voxels", "bytes"})
      EXPECT_THAT(run.out, HasSubstr(word)) << file;
  }
  const auto details = esvr2vdb({"--list", source(), "-v"});
  EXPECT_THAT(details.out, Says("creator", "active box ("));
  const auto grids = inspectVdb(source()).grids;
  EXPECT_THAT(details.out, HasSubstr(std::to_string(grids[0].activeVoxels)));
  EXPECT_GT(grids[0].storedBytes, 100u);
  EXPECT_LT(grids[0].storedBytes + grids[1].storedBytes, std::filesystem::file_size(source()));
}

TEST_F(Esvr2Vdb, saysWhichGridOrValueAMistypedOneMayBe) {
  EXPECT_THAT(esvr2vdb({in(), out(), "-g", "densty"}).err,
              HasSubstr("\"density\", \"heat\"; did you mean \"density\"?"));
  EXPECT_THAT(esvr2vdb({in(), out(), "-g", "velocity"}).err, Not(HasSubstr("did you mean")));
  EXPECT_THAT(esvr2vdb({in(), out(), "--half", "of"}).err, HasSubstr("; did you mean off?"));
}

openvdb::FloatGrid::Ptr gridWithUnits(const std::string& name) {
  auto grid = openvdb::FloatGrid::create();
  grid->setName(name);
  for (int x = 0; x < 20; ++x) grid->tree().setValue({x, 0, 0}, float(x));
  grid->insertMeta("length_unit", openvdb::StringMetadata("mm"));
  grid->insertMeta("timeUnits", openvdb::FloatMetadata(0.5f));
  grid->insertMeta("community", openvdb::StringMetadata("none"));
  return grid;
}

TEST_F(Esvr2Vdb, listsWhoMadeAFileItsFrameRateAndItsUnits) {
  openvdb::initialize();
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator", openvdb::StringMetadata("a\nprogram"));
  metadata.insertMeta("Frame_Rate", openvdb::DoubleMetadata(23.976));
  metadata.insertMeta("note", openvdb::StringMetadata("of no interest"));
  const auto plain = openvdb::FloatGrid::create();
  plain->setName("plain");
  plain->tree().setValue({0, 0, 0}, 1.0f);
  const std::string vdb = folder_ / "units.vdb", esvr = folder_ / "units.esvr";
  openvdb::io::File(vdb).write({gridWithUnits("ct"), plain, gridWithUnits("dose")}, metadata);
  succeeded(vdb2esvr({vdb, esvr, "--lossless", "--keep", "dose"}));
  for (const std::string& file : {vdb, esvr})
    EXPECT_THAT(succeeded(esvr2vdb({"--list", file})).out,
                Says(" bytes\nFrame_Rate 23.98, creator a?program\n\n",
                     "\nct, dose: length_unit mm, timeUnits 0.5\n", Not(HasSubstr("plain:")),
                     Not(HasSubstr("none"))))
        << file;
}

TEST_F(Esvr2Vdb, listsTheFrameRateOfASequence) {
  openvdb::initialize();
  openvdb::MetaMap metadata;
  metadata.insertMeta("fps", openvdb::Int32Metadata(24));
  for (const int frame : {1, 2})
    openvdb::io::File(folder_ / ("f." + std::to_string(frame) + ".vdb"))
        .write({gridWithUnits("ct")}, metadata);
  const std::string pattern = folder_ / "f.@.vdb", file = folder_ / "f.esvr";
  succeeded(vdb2esvr({pattern, file, "--lossless"}));
  EXPECT_THAT(esvr2vdb({"--list", pattern}).out, HasSubstr(" a file each\nfps 24\n\n"));
  EXPECT_THAT(esvr2vdb({"--list", file}).out,
              Says(" in 1 group\nfps 24\n\n", "\nct: length_unit mm"));
}

TEST_F(Esvr2Vdb, saysThatNanoVdbHoldsNoMetadata) {
  EXPECT_THAT(succeeded(esvr2vdb({in(), folder_ / "out.nvdb"})).err, Says("warning", "metadata"));
  EXPECT_THAT(esvr2vdb({in(), out()}).err, Not(HasSubstr("metadata")));
}

TEST_F(Esvr2Vdb, doesNotCountWhatNanoVdbHoldsAsLostMetadata) {
  const auto messagesOf = [&](const char* item) {
    const auto grid = openvdb::FloatGrid::create();
    grid->setName("density");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->tree().setValue({1, 2, 3}, 1.0f);
    if (item) grid->insertMeta(item, openvdb::Int32Metadata(1));
    openvdb::io::File(at("plain.vdb")).write(openvdb::GridPtrVec{grid});
    succeeded(quickFit(at("plain.vdb"), at("plain.esvr"), "-f"));
    succeeded(esvr2vdb({at("plain.esvr"), at("back.vdb"), "-f"}));  // esvr2vdb adds its own name
    succeeded(quickFit(at("back.vdb"), at("plain.esvr"), "-f"));
    return succeeded(esvr2vdb({at("plain.esvr"), at("plain.nvdb"), "-f"})).err;
  };
  EXPECT_THAT(messagesOf(nullptr), IsEmpty());
  EXPECT_THAT(messagesOf("shot"), HasSubstr("(1 item)"));
}

/// Writes an .esvr file whose only ellipsoid reaches thousands of voxels.
void writeHugeScale(const std::string& path) {
  StoredGrid grid;
  grid.descriptor.name = "smoke";
  grid.descriptor.transform = uniformTransform(1.0);
  grid.activeBox = {{-10'000, -10'000, -10'000}, {10'000, 10'000, 10'000}};
  grid.valueMax = 1.0f;
  grid.field.chunks.resize(1);
  Ellipsoids& e = grid.field.chunks[0].ellipsoids;
  e.resize(1);
  for (auto& scale : e.logScale) scale[0] = 8.0f;
  e.rotation[0][0] = e.intensity[0] = 1.0f;
  EsvrFile file;
  file.grids.push_back(grid);
  writeEsvr(path, file);
}

TEST_F(Esvr2Vdb, refusesWhatNeedsMoreMemoryThanAllowed) {
  const std::string huge = folder_ / "huge.esvr";
  writeHugeScale(huge);
  for (const char* limit : {"1GB", "20MB"})
    EXPECT_THAT(esvr2vdb({huge, out(), "--max-memory", limit}),
                Fails(5, "smoke", "GB of memory", "--max-memory"));
  EXPECT_FALSE(outIsThere());
  EXPECT_THAT(esvr2vdb({in(), out(), "--max-memory", "1KB"}), Fails(5));
  EXPECT_THAT(esvr2vdb({in(), out(), "--max-memory", "few"}), Fails(2));
  succeeded(esvr2vdb({in(), out(), "--max-memory", "1GB"}));
  succeeded(
      esvr2vdb({huge, folder_ / "part.vdb", "--bbox", "0,0,0,31,31,31", "--max-memory", "100MB"}));
}

TEST_F(Esvr2Vdb, checksAFile) {
  EXPECT_THAT(succeeded(esvr2vdb({"--check", in()})).out, HasSubstr("in.esvr: OK\n"));
  std::string bytes = readText(in());
  bytes[bytes.size() / 2] ^= 1;
  writeText(in(), bytes);
  EXPECT_THAT(esvr2vdb({"--check", in()}), Fails(3, "in.esvr"));
}

class RefusedRun : public Esvr2Vdb, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedRun, isExplainedAndLeavesNoFile) {
  GetParam().expectOf(esvr2vdb(GetParam().argumentsIn(folder_)));
  EXPECT_THAT(folder_.names(), ElementsAre("in.esvr", "source.vdb"));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedRun,
    testing::Values(Refusal{{}, 2, "IN.esvr"}, Refusal{"DIR/in.esvr", 2, "OUT.vdb"},
                    Refusal{"DIR/in.esvr DIR/out.txt", 2, ".vdb or .nvdb"},
                    Refusal{"DIR/in.esvr DIR/out.vdb --threshold -1", 2, "--threshold"},
                    Refusal{"DIR/in.esvr DIR/out.vdb --half maybe", 2, "maybe"},
                    Refusal{"DIR/in.esvr DIR/out.vdb --box 0,0,0,1,1,1", 2, "--reference"},
                    Refusal{"DIR/in.esvr DIR/out.vdb --list", 2, "--list"},
                    Refusal{"DIR/in.esvr DIR/out.vdb --lod 0", 2, "--lod"},
                    Refusal{"DIR/in.esvr DIR/out.vdb --max-ellipsoids -1", 2, "--max-ellipsoids"},
                    Refusal{"DIR/in.esvr DIR/out.vdb --bbox 1,2,3", 2, "bbox"},
                    Refusal{"--check DIR/in.esvr --lod 1", 2, "--check"},
                    Refusal{"--list --check DIR/in.esvr", 2, "two jobs"},
                    Refusal{"DIR/none.esvr DIR/out.vdb", 3, "none.esvr"},
                    Refusal{"DIR/source.vdb DIR/out.vdb", 3, "source.vdb"},
                    Refusal{"DIR/in.esvr DIR/out.vdb -g smoke", 3, "\"density\""},
                    Refusal{"DIR/in.esvr DIR/out.vdb --reference DIR/none.vdb", 3, "none.vdb"},
                    Refusal{"DIR/in.esvr DIR/none/out.vdb", 1, "none/out.vdb"}));

TEST_F(Esvr2Vdb, keepsAnExistingFileUnlessForced) {
  writeText(out(), "precious");
  EXPECT_THAT(esvr2vdb({in(), out()}), Fails(1, "--force"));
  EXPECT_EQ(readText(out()), "precious");
  succeeded(esvr2vdb({in(), out(), "-f"}));
}

struct Journey {
  const char* name;
  InputGrid grid;
  double lowestPsnr;  ///< dB over the active voxels
};
std::ostream& operator<<(std::ostream& out, const Journey& journey) { return out << journey.name; }

void expectSameFrame(const GridDescriptor& back, const GridDescriptor& source) {
  EXPECT_EQ(back.name, source.name);
  EXPECT_EQ(back.gridClass, source.gridClass);
  EXPECT_EQ(back.transform, source.transform);
  EXPECT_EQ(back.background, source.background);
  EXPECT_THAT(back.metadata, IsSupersetOf(source.metadata));
}

class ThereAndBack : public Conversion, public testing::WithParamInterface<Journey> {};

TEST_P(ThereAndBack, keepsAllThatIsNotVoxelsAndTheVoxelsAsFitted) {
  writeInput(in(), {GetParam().grid});
  succeeded(fitQuickly());
  convertBack();
  EXPECT_THAT(folder_.names(), ElementsAre("back.vdb", "in.vdb", "out.esvr"));

  const VolumeGrid before = readGrid(in(), "density"), after = readGrid(back(), "density");
  expectSameFrame(after.descriptor, before.descriptor);
  EXPECT_THAT(inspectVdb(back()).metadata, testing::Contains(stringItem("creator", kInputCreator)));
  EXPECT_GE(compareVolumes(before.volume, after.volume).psnrActive, GetParam().lowestPsnr);
}

InputGrid ball(Coord center, float peak = 1.0f, float background = 0.0f) {
  return {.voxels = softBall(center, peak, background), .background = background};
}

InputGrid ballUnder(InputMap map) {
  InputGrid grid = ball({});
  grid.map = map;
  return grid;
}

InputGrid constantBlock() {
  InputGrid grid;
  for (const auto& voxel : softBall({8, 8, 8})) grid.voxels.push_back({voxel.at, 0.7f});
  return grid;
}

InputGrid bothSigns() {
  InputGrid grid = ball({});
  for (const auto& voxel : softBall({20, 0, 0}, -2.0f)) grid.voxels.push_back(voxel);
  return grid;
}

constexpr double kAlike = 25.0;  // dB; errors are about a twentieth of the peak
constexpr double kExact = 100.0;
constexpr int kFarApart = 10'000'000;

INSTANTIATE_TEST_SUITE_P(
    Extremes, ThereAndBack,
    testing::Values(Journey{"an ordinary ball", ball({}), kAlike},
                    Journey{"one voxel", {.voxels = {{{3, -4, 5}, 0.5f}}}, kAlike},
                    Journey{"one constant", constantBlock(), 15.0},
                    Journey{"all zeros", ball({}, 0.0f), kExact},
                    Journey{"one value, the background's", ball({}, 0.0f, 1.0f), kExact},
                    Journey{"background not zero", ball({}, 2.0f, 1.0f), kAlike},
                    Journey{"negative values", ball({}, -3.0f), kAlike},
                    Journey{"both signs", bothSigns(), kAlike},
                    Journey{"tiny values", ball({}, 1e-30f), kAlike},
                    Journey{"huge values", ball({}, 1e30f), kAlike},
                    Journey{"the largest values that are fitted", ball({}, 1e36f), kAlike},
                    Journey{"far up", ball({kFarApart, kFarApart, kFarApart}), kAlike},
                    Journey{"far down", ball({-kFarApart, -kFarApart, -kFarApart}), kAlike},
                    Journey{"a rotated map", ballUnder(InputMap::kRotated), kAlike},
                    Journey{"a sheared map", ballUnder(InputMap::kSheared), kAlike},
                    Journey{"a frustum", ballUnder(InputMap::kFrustum), kAlike}));

using LevelSet = Conversion;

TEST_F(LevelSet, withActiveVoxelsBeyondItsBandComesBackUnchanged) {
  writeInput(in(), {{.voxels = distances(12), .background = 1.0f, .levelSet = true}});
  thereAndBack("--count 300 --iterations 300");
  const VolumeMetrics m =
      compareVolumes(readGrid(in(), "density").volume, readGrid(back(), "density").volume);
  EXPECT_GT(m.psnrActive, kAlike);
}

// ---- Other resolutions

class CoarserGrid : public Vdb2Esvr {
 protected:
  void SetUp() override {
    writeInput(in(), {{.voxels = cloud(20)}});
    succeeded(vdb2esvr({in(), out(), "--lossless"}));
  }
  [[nodiscard]] ProgramRun write(const Words& options) const {
    return esvr2vdb(joined({out(), back(), "--force"}, options));
  }
};

/// A cube of 96^3 active voxels. Its voxels take 3.6 MB, and those of a decoded file as much again.
VolumeGrid filledCube() {
  VolumeGrid grid;
  grid.descriptor.name = "density";
  grid.descriptor.transform = uniformTransform(1.0);
  grid.volume = fullBricks(cornersOfCube(12), 0.0f, [](Coord v) {
    return float((v.x * 7 + v.y * 5 + v.z * 3) % 64 + 1) / 64.0f;
  });
  return grid;
}

void expectSame(const VolumeGrid& a, const VolumeGrid& b) {
  EXPECT_EQ(a.descriptor.transform.affine, b.descriptor.transform.affine);
  EXPECT_EQ(volumeDifference(a.volume, b.volume), "");
}

TEST_F(CoarserGrid, hasTheAveragesAndTheTransform) {
  const StoredGrid stored = readEsvr(out()).grids.front();
  for (const char* factor : {"2", "4", "8"}) {
    succeeded(write({"--coarsen", factor}));
    expectSame(readGrid(back(), 0), decodeAtResolution(stored, std::stod(factor)));
  }
  const std::string nano = folder_ / "back.nvdb";
  succeeded(esvr2vdb({out(), nano, "--coarsen", "2"}));
  EXPECT_EQ(readGrid(nano, 0).volume.active, decodeAtResolution(stored, 2.0).volume.active);
}

TEST_F(CoarserGrid, hasTheSizeOfVoxelsThatIsAskedFor) {
  const StoredGrid stored = readEsvr(out()).grids.front();
  const double size = (*stored.descriptor.transform.affine)[0];
  succeeded(write({"--voxel-size", std::to_string(3.0 * size)}));
  expectSame(readGrid(back(), 0), decodeAtResolution(stored, 3.0));
  EXPECT_THAT(write({"--voxel-size", std::to_string(0.5 * size)}), Fails(2, "cannot become finer"));
  succeeded(quickFit(in(), out(), "--force"));
  succeeded(write({"--voxel-size", std::to_string(0.5 * size)}));
  EXPECT_GT(activeVoxelCount(readGrid(back(), 0).volume), 4 * stored.activeVoxels);
}

TEST_F(CoarserGrid, isAsLargeAsTheMemoryAllows) {
  succeeded(write("--coarsen auto"));
  EXPECT_EQ(activeVoxelCount(readGrid(back(), 0).volume),
            readEsvr(out()).grids.front().activeVoxels);
  std::filesystem::remove(in());
  writeGrids(in(), {}, std::vector<VolumeGrid>{filledCube()});
  succeeded(vdb2esvr({in(), out(), "--force", "--max-error", "0.005"}));
  EXPECT_THAT(succeeded(write("--coarsen auto --max-memory 10MB")).err,
              HasSubstr("--coarsen auto: voxels become"));
  EXPECT_LT(8 * activeVoxelCount(readGrid(back(), 0).volume),
            2 * readEsvr(out()).grids.front().activeVoxels);
}

TEST_F(CoarserGrid, ofACarriedGridIsThatOfItsVoxels) {
  std::filesystem::remove(in());
  writeInput(in(), {{.voxels = softBall({})}, {.name = "kept", .voxels = softBall({})}});
  succeeded(quickFit(in(), out(), "--force --keep kept"));
  EXPECT_EQ(succeeded(write("--coarsen auto")).err, "");
  EXPECT_EQ(readEsvr(out()).carried.size(), 1u);
  const VolumeGrid whole = readGrid(in(), "kept");
  EXPECT_EQ(volumeDifference(readGrid(back(), "kept").volume, whole.volume), "");
  const SparseVolume expected = coarsened(whole.volume, 2);
  for (const Words& options :
       {Words{"--coarsen", "2"},
        Words{"--voxel-size", std::to_string(2.0 * (*whole.descriptor.transform.affine)[0])}}) {
    EXPECT_EQ(succeeded(write(options)).err, "");
    EXPECT_EQ(volumeDifference(readGrid(back(), "kept").volume, expected), "");
  }
  const std::string finer = std::to_string(0.5 * (*whole.descriptor.transform.affine)[0]);
  EXPECT_THAT(succeeded(write({"--voxel-size", finer})).err, HasSubstr("is left out"));
  EXPECT_THAT(inspectVdb(back()).grids, testing::SizeIs(1));
}

TEST_F(CoarserGrid, ofCarriedVectorsIsThatOfTheirComponents) {
  std::filesystem::remove(in());
  writeVectorInput(in(), {.voxels = softBall({})});
  succeeded(vdb2esvr({in(), out(), "--force", "--keep", "velocity"}));
  ASSERT_EQ(readEsvr(out()).carried.size(), 1u);
  succeeded(write("--coarsen 2"));
  const VectorGrid source = readVector(in(), 0), made = readVector(back(), 0);
  EXPECT_EQ(made.descriptor.transform.affine, transformAt(source.descriptor.transform, 2.0).affine);
  VectorVolume expected;
  for (std::size_t c = 0; c < kComponents; ++c) expected[c] = coarsened(source.components[c], 2);
  const VectorVolume wanted = aligned(expected), got = aligned(made.components);
  for (std::size_t c = 0; c < kComponents; ++c) EXPECT_EQ(volumeDifference(got[c], wanted[c]), "");
}

TEST_F(CoarserGrid, ofVectorsIsThatOfTheirComponents) {
  writeVectorInput(in(), {.voxels = softBall({})});
  succeeded(
      vdb2esvr({in(), out(), "--force", "--representation", "voxels", "--max-error", "0.001"}));
  succeeded(write("--coarsen 2"));
  const EsvrFile file = readEsvr(out());
  const VectorGrid expected =
      decodeVectorAtResolution("velocity", componentsOf(file, file.vectors.front()), 2.0);
  const VectorVolume made = readVector(back(), 0).components, wanted = aligned(expected.components);
  for (std::size_t c = 0; c < kComponents; ++c) EXPECT_EQ(volumeDifference(made[c], wanted[c]), "");
}

TEST_F(CoarserGrid, isRefusedWhereOptionsContradictEachOther) {
  for (const auto& [options, words] :
       {std::pair{Words{"--coarsen", "3"}, "--coarsen must be 2, 4, 8 or auto"},
        {{"--coarsen", "2", "--voxel-size", "1"}, "exclude each other"},
        {{"--coarsen", "2", "--reference", in()}, "--reference compares voxels of one size"},
        {{"--voxel-size", "1e9"}, "grid 'density': voxels can become"}}) {
    EXPECT_THAT(write(options), Fails(2, words));
  }
  EXPECT_THAT(esvr2vdb({"--list", out(), "--coarsen", "2"}), Fails(2));
}

TEST_F(CoarserGrid, isRefusedByItsNameWhereItIsAFrustum) {
  std::filesystem::remove(in());
  writeInput(in(), {{.voxels = softBall({})},
                    {.name = "seen", .voxels = softBall({}), .map = InputMap::kFrustum}});
  succeeded(quickFit(in(), out(), "--force"));
  for (const Words& options : {Words{"--coarsen", "2"}, {"--voxel-size", "1"}})
    EXPECT_THAT(write(options), Fails(2, "grid 'seen': the voxels of a frustum"));
  succeeded(write({"--coarsen", "2", "-g", "density"}));
}

}  // namespace

}  // namespace esvr::test
