// Plan: for each goal, one volume is converted for which ellipsoids are better and one for which
// voxels are better. The better representation is stored, and the record of the choice has the
// figures of both. Each representation can be prescribed. Contradictory options are refused. A frame continues the
// ellipsoids of the frame before with one fit, and is searched anew where the scene changes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "encode/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

Conversion choose(const SparseVolume& volume, const Goal& goal,
                  Representation representation = Representation::kAuto) {
  ConvertOptions options;
  options.goal = goal;
  options.representation = representation;
  options.fit.iterations = 200;
  options.fit.kappa = 0.0f;
  return convertVolume({{}, volume}, options);
}

double psnrOver(const SparseVolume& volume, const Conversion& conversion) {
  return compareVolumes(volume, decodeGrid(conversion.grid)).psnrBox;
}

TEST(ChoiceForAPsnr, TakesVoxelsOfNoise) {
  const SparseVolume volume = test::noiseVolume(2);
  const Conversion conversion = choose(volume, PsnrGoal{40.0});
  ASSERT_TRUE(conversion.grid.voxels);
  EXPECT_EQ(conversion.fit.end, FitEnd::kPsnrReached);
  EXPECT_GE(psnrOver(volume, conversion), 40.0);
  ASSERT_TRUE(conversion.choice && conversion.choice->ellipsoids);
  EXPECT_TRUE(conversion.choice->ellipsoids->estimated)
      << "a short fit shows that voxels are right";
  EXPECT_GT(conversion.choice->ellipsoids->seconds, 0.0);
  EXPECT_GT(conversion.choice->voxels->seconds, 0.0);
  EXPECT_GT(conversion.choice->ellipsoids->bytes, bytesAdded(conversion.grid));
}

TEST(ChoiceForAPsnr, SlowTakesEllipsoidsOfBlobs) {
  const SparseVolume volume = test::smoothVolume();
  const Conversion conversion = choose(volume, PsnrGoal{35.0});
  EXPECT_FALSE(conversion.grid.voxels);
  EXPECT_GE(psnrOver(volume, conversion), 35.0);
  ASSERT_TRUE(conversion.choice && conversion.choice->voxels);
  EXPECT_EQ(conversion.choice->ellipsoids->bytes, bytesAdded(conversion.grid));
  EXPECT_LT(bytesAdded(conversion.grid), conversion.choice->voxels->bytes);
}

TEST(ChoiceForAPsnr, SlowStoresTheRepresentationThatIsInsistedOn) {
  const SparseVolume volume = test::smoothVolume();
  const Conversion voxels = choose(volume, PsnrGoal{35.0}, Representation::kVoxels);
  EXPECT_TRUE(voxels.grid.voxels);
  EXPECT_FALSE(voxels.choice->ellipsoids);
  EXPECT_GE(psnrOver(volume, voxels), 35.0);
  EXPECT_FALSE(choose(volume, PsnrGoal{35.0}, Representation::kEllipsoids).grid.voxels);
}

/// Neither has figures of ellipsoids, for which nothing was fitted.
TEST(ChoiceForAPsnr, BeyondSumsOfFloatsTakesVoxels) {
  const SparseVolume volume = test::smoothVolume();
  const Conversion fine = choose(volume, PsnrGoal{120.0}), exact = choose(volume, PsnrGoal{200.0});
  EXPECT_GE(psnrOver(volume, fine), 120.0);
  EXPECT_EQ(decodeGrid(exact.grid).values, volume.values);
  for (const Conversion* made : {&fine, &exact}) {
    EXPECT_TRUE(made->grid.voxels);
    EXPECT_FALSE(made->choice->ellipsoids);
  }
}

TEST(ChoiceForAPsnr, ThatIsCancelledBeforeItBeginsHasNoResult) {
  const SparseVolume volume = test::smoothVolume();
  CancelToken cancel;
  cancel.cancel();
  for (const Goal& goal : {Goal{PsnrGoal{35.0}}, Goal{SizeGoal{20000}}}) {
    ConvertOptions options;
    options.goal = goal;
    options.fit.cancel = &cancel;
    EXPECT_THROW((void)convertVolume({{}, volume}, options), Cancelled);
  }
}

/// A ball with a soft border, which a dozen ellipsoids approximate.
SparseVolume ballVolume(double border = 0.15) {
  return test::volumeOf({}, 8, 0.0f, [border](Coord v) {
    const double r = std::hypot(v.x - 31.5, v.y - 31.5, v.z - 31.5) / 32.0;
    const double value = 0.5 - 0.5 * std::tanh((r - 0.6) / border);
    return value > 0.01 ? float(value) : 0.0f;
  });
}

/// A whole fit that continues the short one takes a fraction of the time of another one, and need not save as much.
TEST(ChoiceForAPsnr, SlowTakesAContinuedFitThatSavesLittle) {
  const SparseVolume volume = ballVolume();
  ConvertOptions options;
  options.goal = PsnrGoal{52.0};
  const Conversion conversion = convertVolume({{}, volume}, options);
  ASSERT_FALSE(conversion.grid.voxels);
  EXPECT_GE(psnrOver(volume, conversion), 52.0);
  EXPECT_LT(double(bytesAdded(conversion.grid)), 0.6 * double(conversion.choice->voxels->bytes));
}

/// No voxels show that thousands of ellipsoids, with which the search begins, are far too many.
TEST(ChoiceForAPsnr, SlowOfEllipsoidsAloneTakesAFew) {
  const SparseVolume volume = ballVolume();
  ConvertOptions options;
  options.goal = PsnrGoal{50.0};
  options.representation = Representation::kEllipsoids;
  const Conversion conversion = convertVolume({{}, volume}, options);
  EXPECT_GE(psnrOver(volume, conversion), 50.0);
  EXPECT_LT(conversion.grid.field.ellipsoidCount(), 200u);
}

/// At the least effort, a fit is tried where voxels take few bits, for a quality and for a size.
TEST(ChoiceAtTheLeastEffort, FitsWhatIsSmoothAlone) {
  ConvertOptions options;
  options.effort = kLeastEffort;
  const SparseVolume smooth = ballVolume(), noise = test::noiseVolume(2);
  for (const Goal& goal : {Goal{PsnrGoal{40.0}}, Goal{SizeGoal{1500}}}) {
    options.goal = goal;
    const Conversion conversion = convertVolume({{}, smooth}, options);
    EXPECT_FALSE(conversion.grid.voxels);
    EXPECT_FALSE(conversion.fitsTookTooLong);
  }
  for (const Goal& goal : {Goal{PsnrGoal{40.0}}, Goal{SizeGoal{3000}}}) {
    options.goal = goal;
    const Conversion conversion = convertVolume({{}, noise}, options);
    EXPECT_TRUE(conversion.grid.voxels);
    EXPECT_TRUE(conversion.fitsTookTooLong);
    EXPECT_FALSE(conversion.choice && conversion.choice->ellipsoids);
  }
  options.goal = PresetGoal{};
  const Conversion small = convertVolume({{}, test::noiseVolume(1)}, options);
  EXPECT_TRUE(small.grid.voxels);
  EXPECT_FALSE(small.fitsTookTooLong) << "voxels are so small that no effort fits them";
  options.representation = Representation::kVoxels;
  EXPECT_FALSE(convertVolume({{}, smooth}, options).fitsTookTooLong) << "none was asked for";
}

TEST(ChoiceForASize, TakesVoxelsOfNoise) {
  const SparseVolume volume = test::noiseVolume(2);
  const Conversion conversion = choose(volume, SizeGoal{3000});
  EXPECT_TRUE(conversion.grid.voxels);
  EXPECT_LE(bytesAdded(conversion.grid), 3000u);
  ASSERT_TRUE(conversion.choice && conversion.choice->ellipsoids);
  EXPECT_GT(*conversion.choice->voxels->psnr, *conversion.choice->ellipsoids->psnr);
}

TEST(ChoiceForASize, SlowTakesEllipsoidsOfBlobs) {
  const SparseVolume volume = test::smoothVolume();
  const Conversion conversion = choose(volume, SizeGoal{2000});
  EXPECT_FALSE(conversion.grid.voxels);
  EXPECT_LE(bytesAdded(conversion.grid), 2000u);
  ASSERT_TRUE(conversion.choice && conversion.choice->voxels);
  EXPECT_TRUE(conversion.choice->voxels->estimated)
      << "a short fit and the first bricks show that ellipsoids are right";
  EXPECT_GT(conversion.choice->voxels->bytes, 2000u);
  EXPECT_GT(conversion.choice->voxels->seconds, 0.0);
  const auto seen = transmittancePsnr(volume, decodeGrid(conversion.grid));
  const double gain =
      10.0 * std::log10(activeBox(volume).volume() / double(activeVoxelCount(volume)));
  const double limit =
      psnrOver(volume, conversion) - gain + (conversion.grid.tone.isOn() ? 4.0 : -2.0);
  // The search scales sums of float32, where a reader decodes scaled steps.
  EXPECT_NEAR(*conversion.choice->ellipsoids->psnr, std::min(seen->psnr50, limit), 1e-5);
}

TEST(ChoiceForASize, TakesExactVoxelsWhereTheyFit) {
  const SparseVolume volume = test::noiseVolume(1);
  const Conversion conversion = choose(volume, SizeGoal{1'000'000});
  EXPECT_EQ(decodeGrid(conversion.grid).values, volume.values);
}

/// The PSNR over the active voxels that a reader gets; errors at inactive voxels count too.
double psnrOfActive(const SparseVolume& volume, const Conversion& conversion) {
  const auto box = activeBox(volume).volume();
  return psnrOver(volume, conversion) - 10.0 * std::log10(box / double(activeVoxelCount(volume)));
}

TEST(ChoiceForAPreset, SlowHasItsQualityOverTheActiveVoxels) {
  const SparseVolume volume = test::noiseVolume(3);
  std::uint64_t before = 0;
  for (const Preset preset : {Preset::kDraft, Preset::kStandard, Preset::kHigh}) {
    ConvertOptions options;
    options.goal = PresetGoal{};
    options.fit.preset = preset;
    const Conversion conversion = convertVolume({{}, volume}, options);
    EXPECT_GE(psnrOfActive(volume, conversion), qualityOf(preset).psnr);
    EXPECT_LE(psnrOfActive(volume, conversion), qualityOf(preset).psnr + 1.0);
    EXPECT_GT(bytesAdded(conversion.grid), before);
    before = bytesAdded(conversion.grid);
  }
}

TEST(ChoiceForAPreset, SlowTakesAFewEllipsoidsThoughTheFirstFitHasManyMore) {
  const SparseVolume volume = ballVolume();
  ConvertOptions options;
  options.goal = PresetGoal{};
  GridDescriptor descriptor;
  descriptor.gridClass = GridClass::kFogVolume;
  const Conversion conversion = convertVolume({descriptor, volume}, options);
  ASSERT_FALSE(conversion.grid.voxels);
  EXPECT_LT(conversion.grid.field.ellipsoidCount(), 100u);
  ASSERT_TRUE(conversion.choice && conversion.choice->voxels);
  EXPECT_LT(bytesAdded(conversion.grid), conversion.choice->voxels->bytes);
}

/// Voxels of few bytes are taken without a fit, but not where only their least bytes are known to be few.
TEST(ChoiceForAPreset, SlowTakesEllipsoidsThatAreFarSmallerThanSmallVoxels) {
  const SparseVolume volume = ballVolume(0.25);
  ConvertOptions options;
  options.goal = PresetGoal{};
  options.fit.preset = Preset::kDraft;
  GridDescriptor descriptor;
  descriptor.gridClass = GridClass::kFogVolume;
  const Conversion conversion = convertVolume({descriptor, volume}, options);
  ASSERT_FALSE(conversion.grid.voxels);
  ASSERT_TRUE(conversion.choice->voxels && conversion.choice->voxels->estimated);
  EXPECT_LT(conversion.choice->voxels->bytes, 1024u);
  EXPECT_LT(2 * bytesAdded(conversion.grid), conversion.choice->voxels->bytes);
}

TEST(ChoiceForAPreset, CountsTheActiveVoxelsOfTheBox) {
  const SparseVolume volume = test::noiseVolume(2);
  ConvertOptions options;
  options.goal = PresetGoal{};
  options.fit.box = Box{{0, 0, 0}, {63, 63, 63}};
  const Conversion conversion = convertVolume({{}, volume}, options);
  const double psnr =
      compareVolumes(volume, decodeGrid(conversion.grid), {.box = options.fit.box}).psnrBox;
  const double wider = 10.0 * std::log10(64.0 * 64.0 * 64.0 / double(activeVoxelCount(volume)));
  EXPECT_GE(psnr, qualityOf(options.fit.preset).psnr + wider);
}

TEST(ChoiceForAPreset, SlowStoresTheRepresentationThatIsInsistedOn) {
  const SparseVolume volume = test::smoothVolume();
  EXPECT_TRUE(choose(volume, PresetGoal{}, Representation::kVoxels).grid.voxels);
  EXPECT_FALSE(choose(volume, PresetGoal{}, Representation::kEllipsoids).grid.voxels);
}

TEST(ChoiceForAPreset, StoresAConstantInAFewBytes) {
  const SparseVolume flat = test::volumeOf({}, 4, 0.0f, [](Coord) { return 0.5f; });
  const Conversion conversion = choose(flat, PresetGoal{});
  EXPECT_EQ(decodeGrid(conversion.grid).values, flat.values);
  EXPECT_LT(bytesAdded(conversion.grid), 600u);
}

/// A conversion of blobs or of a frame after them, and the number of ellipsoids with which its first fit begins.
struct Frame {
  Conversion conversion;
  std::optional<std::size_t> begins;
};
Frame frameOf(const SparseVolume& volume, const StoredGrid* previous,
              const std::optional<CompactRecord>& compact = {}) {
  Frame made;
  ConvertOptions options;
  options.goal = PsnrGoal{35.0};
  options.fit.iterations = 200;
  options.fit.kappa = 0.0f;
  options.fit.progress = [&](const FitProgress& progress) {
    if (!made.begins) made.begins = progress.point.ellipsoids;
  };
  options.previous = previous;
  options.previousCompact = compact;
  made.conversion = convertVolume({{}, volume}, options);
  return made;
}

TEST(ChoiceForAFrame, SlowContinuesTheEllipsoidsOfTheFrameBefore) {
  const Frame first = frameOf(test::smoothVolume(), nullptr);
  ASSERT_FALSE(first.conversion.grid.voxels);
  const SparseVolume moved = test::smoothVolume(1.0);
  const Frame alone = frameOf(moved, nullptr), next = frameOf(moved, &first.conversion.grid);
  const double before = double(first.conversion.grid.field.ellipsoidCount());
  EXPECT_NEAR(double(*next.begins), 0.9 * before, 1.0 + 0.01 * before);
  EXPECT_GT(double(*alone.begins), before) << "a search of its own begins with another number";
  ASSERT_FALSE(next.conversion.grid.voxels);
  EXPECT_FALSE(next.conversion.choice->voxels) << "no voxels are tried";
  EXPECT_EQ(next.conversion.fit.end, FitEnd::kPsnrReached);
  EXPECT_GE(psnrOver(moved, next.conversion), 35.0);
  EXPECT_LT(double(bytesAdded(next.conversion.grid)),
            1.1 * double(bytesAdded(alone.conversion.grid)));
}

TEST(ChoiceForAFrame, SlowHasFewerEllipsoidsWhereTheFrameBeforeWasRoundedMore) {
  const SparseVolume volume = test::smoothVolume(), moved = test::smoothVolume(1.0);
  const Frame first = frameOf(volume, nullptr);
  ASSERT_TRUE(first.conversion.compact);
  const auto begins = [&](double loss) {
    const CompactRecord record{loss, first.conversion.compact->steps};
    const Frame next = frameOf(moved, &first.conversion.grid, record);
    EXPECT_GE(psnrOver(moved, next.conversion), 35.0) << "after a loss of " << loss << " dB";
    return *next.begins;
  };
  const std::size_t fine = begins(0.1), coarse = begins(2.0);
  EXPECT_LT(coarse, fine);
}

TEST(ChoiceForAFrame, SlowIsSearchedAnewWhereTheSceneChanges) {
  const Frame blobs = frameOf(test::smoothVolume(), nullptr);
  ASSERT_FALSE(blobs.conversion.grid.voxels);
  const SparseVolume noise = test::noiseVolume(2);
  const Frame alone = frameOf(noise, nullptr), next = frameOf(noise, &blobs.conversion.grid);
  ASSERT_TRUE(next.conversion.grid.voxels);
  EXPECT_EQ(next.conversion.grid.voxels->codes, alone.conversion.grid.voxels->codes);
  // A constant takes a few bytes as voxels, whatever was there before.
  const SparseVolume constant = test::volumeOf({}, 2, 0.0f, [](Coord) { return 1.0f; });
  EXPECT_TRUE(frameOf(constant, &blobs.conversion.grid).conversion.grid.voxels);
}

TEST(Choice, SlowVoxelsKeepTheMaskOfALevelSetOnly) {
  const SparseVolume band = test::levelSetVolume();
  const auto iou = [&](GridClass gridClass, const Goal& goal) {
    GridDescriptor descriptor;
    descriptor.gridClass = gridClass;
    ConvertOptions options;
    options.goal = goal;
    options.representation = Representation::kVoxels;
    const Conversion conversion = convertVolume({descriptor, band}, options);
    return compareVolumes(band, decodeGrid(conversion.grid)).iou;
  };
  for (const Goal& goal : {Goal{PsnrGoal{25.0}}, Goal{BoundGoal{0.1, true}}}) {
    EXPECT_EQ(iou(GridClass::kLevelSet, goal), 1.0);
    EXPECT_LT(iou(GridClass::kFogVolume, goal), 1.0);
  }
}

TEST(ChoiceForAFit, SlowTakesExactVoxelsWhereEllipsoidsWouldTakeMoreBytes) {
  const SparseVolume flat = test::volumeOf({}, 4, 0.0f, [](Coord) { return 0.5f; });
  const Conversion conversion = choose(flat, FitGoal{});
  EXPECT_TRUE(conversion.grid.voxels);
  EXPECT_EQ(decodeGrid(conversion.grid).values, flat.values);
  EXPECT_FALSE(choose(test::smoothVolume(), FitGoal{}).grid.voxels);
}

/// One ellipsoid more or less decides here. With two fits, 40 dB were missed, and took 1,589 bytes of voxels.
TEST(ChoiceForAPsnr, TakesNoMoreBytesForALowerOneRealFile) {
  if (std::string(ESVR_DATA_DIR).empty())
    GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
  const std::string file = std::string(ESVR_DATA_DIR) + "/hydrogen_atom.vdb";
  const VolumeGrid grid = readGrid(file, inspectVdb(file).grids.front().uniqueName);
  const auto bytesFor = [&](double psnr) {
    ConvertOptions options;
    options.goal = PsnrGoal{psnr};
    return bytesAdded(convertVolume({grid.descriptor, grid.volume}, options).grid);
  };
  EXPECT_LE(bytesFor(40.0), bytesFor(46.0));
}

TEST(Choice, RefusesWhatExcludesEachOther) {
  const SparseVolume volume = test::noiseVolume(1);
  EXPECT_THROW((void)choose(volume, FitGoal{}, Representation::kVoxels), UsageError);
  EXPECT_THROW((void)choose(volume, LosslessGoal{}, Representation::kEllipsoids), UsageError);
  EXPECT_THROW((void)choose(volume, SizeGoal{40}), UsageError);
  EXPECT_THROW((void)choose(volume, SizeGoal{40}, Representation::kVoxels), UsageError);
}

}  // namespace
}  // namespace esvr
