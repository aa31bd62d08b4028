// Plan: the tests check the promise of each goal. A size is met and never exceeded. A PSNR is
// reached and not exceeded by much, also with a limit on the number of ellipsoids and as float32. A
// bound on the error holds for every voxel, and the smaller of voxels and ellipsoids is stored.
// Lossless conversion is exact. Goals out of reach are reported and contradictory options are
// refused. The same input gives the same bytes on any number of threads and at any time.

#include "esvr/convert.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>

#include "../fit/volumes.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

const GridDescriptor kDescriptor;

ConvertOptions optionsFor(const Goal& goal) {
  ConvertOptions options;
  options.goal = goal;
  options.fit.iterations = 120;
  options.fit.kappa = 2.0f;
  return options;
}

Conversion converted(const SparseVolume& volume, const Goal& goal) {
  return convertVolume({kDescriptor, volume}, optionsFor(goal));
}

double psnrOf(const SparseVolume& volume, const StoredGrid& grid) {
  return compareVolumes(volume, decodeGrid(grid)).psnrBox;
}

/// Noise, which no sum of fewer ellipsoids than voxels approximates.
SparseVolume noiseVolume(int bricks) {
  test::Random random(3);
  return test::volumeOf({}, bricks, 0.0f, [&](Coord) { return float(random(0.5, 1.0)); });
}

/// Sixteen blobs that are a few voxels wide.
SparseVolume smoothVolume() {
  test::Random random(5);
  std::array<std::array<double, 4>, 16> blobs;  // center and width
  for (auto& [x, y, z, width] : blobs)
    x = random(5, 43), y = random(5, 43), z = random(5, 43), width = random(3, 6);
  return test::volumeOf({}, 6, 0.0f, [&](Coord v) {
    double sum = 0.0;
    for (const auto& [x, y, z, width] : blobs)
      sum += std::exp(-((v.x - x) * (v.x - x) + (v.y - y) * (v.y - y) + (v.z - z) * (v.z - z)) /
                      (2.0 * width * width));
    return float(sum);
  });
}

TEST(ConvertToSize, LandsWithinTwoPerCentUnderTheSize) {
  const SparseVolume volume = test::tubeVolume();
  for (const std::uint64_t bytes : {900u, 1500u}) {
    const Conversion conversion = converted(volume, SizeGoal{bytes});
    EXPECT_LE(bytesAdded(conversion.grid), bytes);
    EXPECT_GE(double(bytesAdded(conversion.grid)), 0.98 * double(bytes));
    EXPECT_TRUE(conversion.grid.curve.empty());
  }
}

TEST(ConvertToSize, IsBetterTheMoreBytesThereAre) {
  const SparseVolume volume = test::tubeVolume();
  EXPECT_GT(psnrOf(volume, converted(volume, SizeGoal{1500}).grid),
            psnrOf(volume, converted(volume, SizeGoal{800}).grid) + 2.0);
}

TEST(ConvertToSize, RefusesWhatCannotHoldTheGrid) {
  const SparseVolume volume = test::tubeVolume();
  EXPECT_THROW((void)converted(volume, SizeGoal{100}), UsageError);
}

TEST(ConvertToSize, RefusesFloat32WhereNoBitsCanBeChosen) {
  const SparseVolume volume = test::tubeVolume();
  ConvertOptions options = optionsFor(SizeGoal{1500});
  options.storage.form = Storage::kFloat32;
  EXPECT_THROW((void)convertVolume({kDescriptor, volume}, options), UsageError);
}

TEST(ConvertToPsnr, ReachesItAndLittleMore) {
  const SparseVolume volume = test::tubeVolume();
  const Conversion conversion = converted(volume, PsnrGoal{32.0});
  EXPECT_EQ(conversion.fit.end, FitEnd::kPsnrReached);
  const double reached = psnrOf(volume, conversion.grid);
  EXPECT_GE(reached, 32.0);
  EXPECT_LT(reached, 32.5);
}

TEST(ConvertToPsnr, ReachesItAsFloat32WithoutQuantising) {
  const SparseVolume volume = test::tubeVolume();
  ConvertOptions options = optionsFor(PsnrGoal{32.0});
  options.storage.form = Storage::kFloat32;
  const Conversion conversion = convertVolume({kDescriptor, volume}, options);
  EXPECT_EQ(conversion.fit.end, FitEnd::kPsnrReached);
  EXPECT_FALSE(conversion.compact);
  EXPECT_TRUE(conversion.grid.quantised.empty());
  EXPECT_GE(psnrOf(volume, conversion.grid), 32.0);
  EXPECT_LT(psnrOf(volume, conversion.grid), 45.0) << "an ellipsoid more is worth a few dB here";
}

TEST(ConvertToPsnr, TakesNoMoreEllipsoidsThanAllowed) {
  const SparseVolume volume = test::tubeVolume();
  ConvertOptions options = optionsFor(PsnrGoal{90.0});
  options.fit.count = 40;
  const Conversion conversion = convertVolume({kDescriptor, volume}, options);
  EXPECT_EQ(conversion.fit.end, FitEnd::kPsnrMissed);
  EXPECT_LE(conversion.grid.field.ellipsoidCount(), 40u);
  EXPECT_GE(conversion.grid.field.ellipsoidCount(), 35u) << "all that were allowed were tried";
}

TEST(ConvertToPsnr, SaysSoWhereItIsOutOfReach) {
  const SparseVolume volume = noiseVolume(1);
  ConvertOptions options = optionsFor(PsnrGoal{120.0});
  options.fit.iterations = 20;
  EXPECT_EQ(convertVolume({kDescriptor, volume}, options).fit.end, FitEnd::kPsnrMissed);
}

TEST(ConvertWithin, SlowTakesEllipsoidsWhereTheyAreSmallerThanVoxels) {
  const double bound = 0.1;
  const SparseVolume volume = smoothVolume();
  ConvertOptions options = optionsFor(BoundGoal{bound});
  options.fit.iterations = 200;
  options.fit.kappa = 0.0f;
  const Conversion conversion = convertVolume({kDescriptor, volume}, options);
  ASSERT_TRUE(conversion.bound);
  ASSERT_TRUE(conversion.grid.residual);
  EXPECT_EQ(bytesAdded(conversion.grid), conversion.bound->ellipsoidBytes);
  EXPECT_LT(conversion.bound->ellipsoidBytes, conversion.bound->voxelBytes);
  EXPECT_LE(largestDifference(volume, decodeGrid(conversion.grid)), bound);
}

TEST(ConvertWithin, TakesVoxelsOfNoise) {
  const double bound = 0.1;
  const SparseVolume volume = noiseVolume(2);
  const Conversion conversion = converted(volume, BoundGoal{bound});
  ASSERT_TRUE(conversion.bound);
  EXPECT_TRUE(conversion.grid.voxels);
  EXPECT_EQ(bytesAdded(conversion.grid), conversion.bound->voxelBytes);
  EXPECT_LE(largestDifference(volume, decodeGrid(conversion.grid)), bound);
}

TEST(ConvertWithin, TriesNoEllipsoidsWhereVoxelsAloneAreAskedFor) {
  const SparseVolume volume = smoothVolume();
  const Conversion conversion = converted(volume, BoundGoal{.bound = 0.1, .voxelsOnly = true});
  EXPECT_TRUE(conversion.grid.voxels);
  EXPECT_EQ(conversion.bound->ellipsoidBytes, 0u);
}

TEST(ConvertWithin, TakesAShareOfTheRange) {
  const SparseVolume volume = noiseVolume(2);  // values from 0.5 to 1
  const BoundGoal share{.bound = 0.1, .relative = true, .voxelsOnly = true};
  const ValueRange range = activeRange(volume);
  const double error = largestDifference(volume, decodeGrid(converted(volume, share).grid));
  EXPECT_LE(error, 0.1 * double(range.max - range.min));
  EXPECT_GT(error, 0.0);
}

TEST(ConvertLossless, GivesEveryVoxelBack) {
  const SparseVolume volume = noiseVolume(2);
  const SparseVolume back = decodeGrid(converted(volume, LosslessGoal{}).grid);
  EXPECT_EQ(back.values, volume.values);
  EXPECT_EQ(back.active, volume.active);
}

TEST(ConvertLossless, RefusesDoubles) {
  const SparseVolume volume = test::tubeVolume();
  GridDescriptor doubles;
  doubles.valueType = ValueType::kDouble;
  EXPECT_THROW((void)convertVolume({doubles, volume}, optionsFor(LosslessGoal{})), UsageError);
}

TEST(ConvertVolume, KeepsTheCurveOfOneFitInTheFile) {
  const SparseVolume volume = test::tubeVolume();
  ConvertOptions options = optionsFor(FitGoal{});
  options.fit.count = 40;
  const Conversion conversion = convertVolume({kDescriptor, volume}, options);
  EXPECT_EQ(conversion.grid.curve, withoutTimes(conversion.fit.curve));
  EXPECT_GT(conversion.grid.curve.size(), 2u);
}

/// Neither the wall-clock time nor the number of threads may change the file.
TEST(ConvertVolume, GivesTheSameBytesAgainOnAnyNumberOfThreads) {
  const SparseVolume volume = test::tubeVolume();
  for (const Goal& goal : {Goal(FitGoal{}), Goal(SizeGoal{1000}), Goal(PsnrGoal{30.0})}) {
    ConvertOptions options = optionsFor(goal);
    const auto bytesOf = [&] {
      return encodeEsvr({{}, {convertVolume({kDescriptor, volume}, options).grid}});
    };
    const auto first = bytesOf();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(bytesOf(), first);
  }
}

TEST(ConvertByPaper, StoresWhatThePapersMethodFitted) {
  const SparseVolume volume = test::tubeVolume();
  PaperFitOptions options;
  options.method.points = 100;
  options.method.epochs = 5;
  options.method.prunes.clear();
  const auto made = convertByPaper({kDescriptor, volume}, options, {.form = Storage::kFloat32});
  EXPECT_EQ(made.record.points, 100u);
  EXPECT_EQ(made.conversion.grid.field.kernel.form, KernelForm::kPaper);
  options.method.learnK = true;
  EXPECT_THROW((void)convertByPaper({kDescriptor, volume}, options, {}), UsageError);
}

TEST(ConvertByPaper, RefusesLevelSets) {
  GridDescriptor levelSet;
  levelSet.gridClass = GridClass::kLevelSet;
  EXPECT_THROW((void)convertByPaper({levelSet, test::levelSetVolume()}, {}, {}), UsageError);
}

TEST(BytesAdded, IsWhatAGridMakesAFileLonger) {
  const SparseVolume volume = test::tubeVolume();
  const StoredGrid grid = converted(volume, LosslessGoal{}).grid;
  const auto sizeOf = [](const EsvrFile& file) { return encodeEsvr(file).size(); };
  // Sections begin at multiples of 8. The padding counts, so several grids take at most this much.
  EXPECT_LE(sizeOf({{}, {grid}}), sizeOf({}) + bytesAdded(grid));
  EXPECT_GT(sizeOf({{}, {grid}}) + 8, sizeOf({}) + bytesAdded(grid));
  EXPECT_LE(sizeOf({{}, {grid, grid}}), sizeOf({}) + 2 * bytesAdded(grid));
  EXPECT_GT(sizeOf({{}, {grid, grid}}) + 8, sizeOf({}) + 2 * bytesAdded(grid));
}

}  // namespace
}  // namespace esvr
