// Plan: for each goal, one volume is converted for which ellipsoids are better and one for which
// voxels are better. The better representation is stored, and the record of the choice has the
// figures of both. Each representation can be prescribed. Searches for voxels reach their goal.
// Contradictory options are refused.

#include <gtest/gtest.h>

#include <cmath>

#include "convert/choice.h"
#include "convert/volumes.h"
#include "convert/voxel_search.h"
#include "esvr/convert.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

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
  EXPECT_EQ(*conversion.choice->ellipsoids->psnr, psnrOver(volume, conversion));
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
    EXPECT_GE(psnrOfActive(volume, conversion), presetPsnr(preset));
    EXPECT_LE(psnrOfActive(volume, conversion), presetPsnr(preset) + 1.0);
    EXPECT_GT(bytesAdded(conversion.grid), before);
    before = bytesAdded(conversion.grid);
  }
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
  EXPECT_GE(psnr, presetPsnr(options.fit.preset) + wider);
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

TEST(Choice, RefusesWhatExcludesEachOther) {
  const SparseVolume volume = test::noiseVolume(1);
  EXPECT_THROW((void)choose(volume, FitGoal{}, Representation::kVoxels), UsageError);
  EXPECT_THROW((void)choose(volume, LosslessGoal{}, Representation::kEllipsoids), UsageError);
  EXPECT_THROW((void)choose(volume, SizeGoal{40}), UsageError);
  EXPECT_THROW((void)choose(volume, SizeGoal{40}, Representation::kVoxels), UsageError);
}

class VoxelSearch : public testing::Test {
 protected:
  GridDescriptor descriptor_;
  SparseVolume volume_ = test::smoothVolume();
  ConvertInput input_{descriptor_, volume_};
  ConvertOptions options_;
  convert::Job job_{input_, options_};
};

TEST_F(VoxelSearch, SlowDoesNotFitWhereLittleCanBeSaved) {
  options_.fit.iterations = 200;
  const auto converted = [&](const convert::PsnrTarget& target) {
    return convert::convertToPsnr(job_, target);
  };
  EXPECT_FALSE(converted({35.0}).grid.voxels);
  const Conversion small = converted({.psnr = 35.0, .smallEnough = 1'000'000});
  EXPECT_TRUE(small.grid.voxels);
  EXPECT_FALSE(small.choice->ellipsoids) << "not even a short fit is made";
  const Conversion worthless = converted({.psnr = 35.0, .worthwhileShare = 0.01});
  EXPECT_TRUE(worthless.grid.voxels);
  EXPECT_TRUE(worthless.choice->ellipsoids && worthless.choice->ellipsoids->estimated);
}

TEST_F(VoxelSearch, SlowReachesAPsnrAndLittleMore) {
  for (const double psnr : {20.0, 40.0, 60.0}) {
    const auto found = convert::voxelsForPsnr(job_, {psnr});
    EXPECT_GE(found.psnr, psnr);
    EXPECT_LT(found.psnr, psnr + 0.5);
    EXPECT_EQ(found.psnr, compareVolumes(volume_, decodeGrid(found.grid)).psnrBox);
    EXPECT_EQ(found.bytes, bytesAdded(found.grid));
  }
}

TEST_F(VoxelSearch, FillsASize) {
  for (const std::uint64_t bytes : {4000u, 20000u}) {
    const auto found = convert::voxelsForSize(job_, bytes).found;
    ASSERT_TRUE(found);
    EXPECT_LE(found->bytes, bytes);
    EXPECT_GE(double(found->bytes), 0.98 * double(bytes));
  }
}

TEST_F(VoxelSearch, FindsNothingOfASizeBelowTheLeastPsnr) {
  const std::uint64_t bytes = 4000;
  const auto best = convert::voxelsForSize(job_, bytes).found;
  ASSERT_TRUE(best);
  const auto found = convert::voxelsForSize(job_, bytes, best->psnr - 1.0);
  ASSERT_TRUE(found.found) << "the least PSNR is reached";
  EXPECT_NEAR(found.found->psnr, best->psnr, 0.3) << "one percent of the size may stay unused";
  EXPECT_FALSE(found.tooLarge);
  const auto none = convert::voxelsForSize(job_, bytes, best->psnr + 6.0);
  EXPECT_FALSE(none.found);
  ASSERT_TRUE(none.tooLarge);
  EXPECT_GT(none.tooLarge->bytes, bytes);
  EXPECT_GE(*none.tooLarge->psnr, best->psnr + 6.0);
  EXPECT_TRUE(none.tooLarge->estimated);
}

TEST_F(VoxelSearch, TakesExactVoxelsOfASizeOnlyIfTheyKeepToIt) {
  const std::uint64_t bytes = convert::exactVoxels(job_).bytes;
  const auto exact = convert::exactVoxelsWithin(job_, bytes);
  ASSERT_TRUE(exact);
  EXPECT_EQ(exact->bytes, bytes);
  EXPECT_EQ(decodeGrid(exact->grid).values, volume_.values);
  EXPECT_FALSE(convert::exactVoxelsWithin(job_, bytes - 1));
  EXPECT_FALSE(convert::exactVoxelsWithin(job_, bytes / 2));
}

TEST_F(VoxelSearch, FindsExactVoxelsWhereNothingElseReachesAPsnr) {
  const auto found = convert::voxelsForPsnr(job_, {250.0});
  EXPECT_TRUE(std::isinf(found.psnr));
  EXPECT_EQ(decodeGrid(found.grid).values, volume_.values);
}

TEST_F(VoxelSearch, TakesExactVoxelsOfDoublesAsTheyWereRead) {
  descriptor_.valueType = ValueType::kDouble;
  const auto found = convert::voxelsForPsnr(job_, {250.0});
  EXPECT_EQ(decodeGrid(found.grid).values, volume_.values);
}

TEST_F(VoxelSearch, PutsAPlateauOnTheLattice) {
  test::Random random(11);
  volume_ = test::volumeOf({}, 3, 0.0f,
                           [&](Coord v) { return v.x < 12 ? 0.731f : float(random(0.1, 0.7)); });
  const auto found = convert::voxelsForPsnr(job_, {30.0});
  const SparseVolume back = decodeGrid(found.grid);
  for (std::size_t i = 0; i < volume_.values.size(); ++i) {
    if (volume_.values[i] != 0.731f) continue;
    ASSERT_NEAR(back.values[i], 0.731f, 1e-5f);
  }
  EXPECT_TRUE(found.plateau.tried && found.plateau.used);
  EXPECT_EQ(found.plateau.bytesWith, found.bytes);
  EXPECT_GT(found.plateau.bytesWithout, found.bytes);
}

TEST_F(VoxelSearch, RecordsThatThereIsNoPlateau) {
  const auto found = convert::voxelsForPsnr(job_, {40.0});
  EXPECT_FALSE(found.plateau.tried || found.plateau.used);
  EXPECT_FALSE(found.plateau.bytesWith);
  EXPECT_TRUE(found.plateau.seconds) << "the voxels were counted";
  EXPECT_GE(found.seconds, *found.plateau.seconds);
}

TEST_F(VoxelSearch, StoresOneValueInFewBytes) {
  volume_ = test::volumeOf({}, 4, 0.0f, [](Coord) { return 0.5f; });
  const auto found = convert::voxelsForPsnr(job_, {40.0});
  EXPECT_GE(found.psnr, 40.0);
  EXPECT_LT(found.bytes, 1000u);
}

}  // namespace
}  // namespace esvr
