// Plan: files with NaN and infinite voxels go through the converters as users run them. They are refused with the option
// that keeps them, and with it they come back where they were, as floats, halfs and doubles, as components of vectors, in
// level sets, in .vdb and .nvdb files, in twins and in sequences. Reports and lists count them, comparisons leave them
// out, and pictures show them as empty.

#include <cmath>
#include <fstream>

#include "cli/conversion.h"
#include "support/non_finite.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

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
