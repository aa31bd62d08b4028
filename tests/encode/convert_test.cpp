// Plan: the tests check the promise of each goal. A size is met and never exceeded. A PSNR is
// reached and not exceeded by much, also with a limit on the number of ellipsoids and as float32. A
// bound on the error holds for every voxel, and the smaller of voxels and ellipsoids is stored.
// Lossless conversion is exact. Goals out of reach are reported and contradictory options are
// refused. The same input gives the same bytes on any number of threads and at any time.

#include "esvr/encode.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <string>

#include "encode/volumes.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

const GridDescriptor kDescriptor;

ConvertOptions optionsFor(const Goal& goal) {
  ConvertOptions options;
  options.goal = goal;
  options.representation = Representation::kEllipsoids;
  options.fit.iterations = 120;
  options.fit.kappa = 2.0f;
  return options;
}

Conversion converted(const SparseVolume& volume, const Goal& goal,
                     Representation representation = Representation::kEllipsoids) {
  ConvertOptions options = optionsFor(goal);
  options.representation = representation;
  return convertVolume({kDescriptor, volume}, options);
}

double psnrOf(const SparseVolume& volume, const StoredGrid& grid) {
  return compareVolumes(volume, decodeGrid(grid)).psnrBox;
}

TEST(ConvertToSize, LandsWithinTwoPerCentUnderTheSize) {
  const SparseVolume volume = test::tubeVolume();
  for (const std::uint64_t bytes : {900u, 1500u}) {
    const Conversion conversion = converted(volume, SizeGoal{bytes});
    EXPECT_LE(bytesAdded(conversion.grid), bytes);
    constexpr double kPadding = 7.0;  // bytes that are reserved and may stay unused
    EXPECT_GE(double(bytesAdded(conversion.grid)) + kPadding, 0.98 * double(bytes));
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

/// A frame that equals the one before, which is decoded, has its PSNR for the bytes of a few
/// decisions, and a frame that differs reaches the PSNR too.
TEST(ConvertToPsnr, ReachesItForFramesInFewerBytes) {
  const SparseVolume first = test::tubeVolume();
  SparseVolume second = first;
  for (float& v : second.values) v *= 0.95f;
  ConvertOptions options = optionsFor(PsnrGoal{35.0});
  options.representation = Representation::kVoxels;
  const StoredGrid before = convertVolume({kDescriptor, first}, options).grid;
  for (const bool keepsPastErrors : {false, true}) {
    options.keepsPastErrors = keepsPastErrors;
    options.previous = nullptr;
    const StoredGrid alone = convertVolume({kDescriptor, second}, options).grid;
    options.previous = &before;
    const StoredGrid frame = convertVolume({kDescriptor, second}, options).grid;
    EXPECT_GE(psnrOf(second, frame), 35.0);
    EXPECT_LT(bytesInFrame(frame, &before), bytesAdded(alone));
  }
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
  const SparseVolume volume = test::noiseVolume(1);
  ConvertOptions options = optionsFor(PsnrGoal{120.0});
  options.fit.iterations = 20;
  EXPECT_EQ(convertVolume({kDescriptor, volume}, options).fit.end, FitEnd::kPsnrMissed);
}

TEST(ConvertWithin, StoresVoxels) {
  const double bound = 0.1;
  for (const SparseVolume& volume : {test::smoothVolume(), test::noiseVolume(2)}) {
    const Conversion conversion = converted(volume, BoundGoal{bound}, Representation::kAuto);
    EXPECT_TRUE(conversion.grid.voxels);
    const double error = largestDifference(volume, decodeGrid(conversion.grid));
    EXPECT_LE(error, bound);
    EXPECT_GT(error, 0.5 * bound);
  }
}

TEST(ConvertWithin, RefusesEllipsoids) {
  const SparseVolume volume = test::smoothVolume();
  EXPECT_THROW((void)converted(volume, BoundGoal{0.1}, Representation::kEllipsoids), UsageError);
  ConvertOptions options = optionsFor(BoundGoal{0.1});
  options.representation = Representation::kAuto;
  options.storage.form = Storage::kFloat32;
  EXPECT_THROW((void)convertVolume({kDescriptor, volume}, options), UsageError);
}

TEST(ConvertWithin, TakesAShareOfTheRange) {
  const SparseVolume volume = test::noiseVolume(2);  // values from 0.5 to 1
  const BoundGoal share{.bound = 0.1, .relative = true};
  const ValueRange range = activeRange(volume);
  const Conversion conversion = converted(volume, share, Representation::kVoxels);
  const double error = largestDifference(volume, decodeGrid(conversion.grid));
  EXPECT_LE(error, 0.1 * double(range.max - range.min));
  EXPECT_GT(error, 0.0);
}

TEST(ConvertLossless, GivesEveryVoxelBack) {
  const SparseVolume volume = test::noiseVolume(2);
  const SparseVolume back =
      decodeGrid(converted(volume, LosslessGoal{}, Representation::kAuto).grid);
  EXPECT_EQ(back.values, volume.values);
  EXPECT_EQ(back.active, volume.active);
}

TEST(ConvertLossless, RefusesDoubles) {
  const SparseVolume volume = test::tubeVolume();
  GridDescriptor doubles;
  doubles.valueType = ValueType::kDouble;
  ConvertOptions options = optionsFor(LosslessGoal{});
  options.representation = Representation::kAuto;
  EXPECT_THROW((void)convertVolume({doubles, volume}, options), UsageError);
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
  const StoredGrid grid = converted(volume, LosslessGoal{}, Representation::kAuto).grid;
  const auto sizeOf = [](const EsvrFile& file) { return encodeEsvr(file).size(); };
  // Sections begin at multiples of 8. The padding counts, so several grids take at most this much.
  EXPECT_LE(sizeOf({{}, {grid}}), sizeOf({}) + bytesAdded(grid));
  EXPECT_GT(sizeOf({{}, {grid}}) + 8, sizeOf({}) + bytesAdded(grid));
  const StoredGrid other = converted(volume, FitGoal{}, Representation::kEllipsoids).grid;
  const std::uint64_t both = bytesAdded(grid) + bytesAdded(other);
  EXPECT_LE(sizeOf({{}, {grid, other}}), sizeOf({}) + both);
  EXPECT_GT(sizeOf({{}, {grid, other}}) + 8, sizeOf({}) + both);
  EXPECT_LT(sizeOf({{}, {grid, grid}}), sizeOf({}) + 2 * bytesAdded(grid));  // stored once
}

/// A smooth pressure in a ball of voxels over a background of 0.
SparseVolume pressureVolume() {
  return test::volumeOf({}, 4, 0.0f, [](Coord v) {
    const double r = std::hypot(v.x - 15.5, v.y - 15.5, v.z - 15.5);
    return r < 14.0 ? float(101325.0 + 20.0 + 20.0 * std::cos(0.2 * r)) : 0.0f;
  });
}

/// Expects the exact mask and background, and active values that lie within those of the source.
void expectNothingBetween(const SparseVolume& source, const StoredGrid& grid) {
  EXPECT_TRUE(grid.farBackground);
  const SparseVolume decoded = decodeGrid(grid);
  EXPECT_EQ(compareVolumes(source, decoded).iou, 1.0);
  EXPECT_EQ(decoded.background, 0.0f);
  const ValueRange wanted = activeRange(source), found = activeRange(decoded);
  const double rounding = 2.0;  // of quantised voxels, far less than from the values to 0
  EXPECT_GE(found.min, wanted.min - rounding);
  EXPECT_LE(found.max, wanted.max + rounding);
  for (std::size_t b = 0; b < decoded.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      ASSERT_TRUE(decoded.active[b].test(v) || decoded.brickValues(b)[std::size_t(v)] == 0.0f);
}

TEST(FarBackground, ReachesThePsnrOfTheRangeInBothRepresentations) {
  const SparseVolume volume = pressureVolume();
  for (const auto representation : {Representation::kEllipsoids, Representation::kVoxels}) {
    const Conversion made = converted(volume, PsnrGoal{35.0}, representation);
    EXPECT_GE(psnrOf(volume, made.grid), 35.0);
    EXPECT_LT(psnrOf(volume, made.grid), 37.0);
    EXPECT_EQ(made.grid.voxels.has_value(), representation == Representation::kVoxels);
    expectNothingBetween(volume, made.grid);
  }
}

TEST(FarBackground, KeepsABoundAndASizeAndTheNumberOfEllipsoids) {
  const SparseVolume volume = pressureVolume();
  const Conversion within = converted(volume, BoundGoal{0.01, true}, Representation::kAuto);
  EXPECT_LE(compareVolumes(volume, decodeGrid(within.grid)).maxError, 0.4);
  expectNothingBetween(volume, within.grid);

  const Conversion sized = converted(volume, SizeGoal{3000}, Representation::kAuto);
  EXPECT_LE(bytesAdded(sized.grid), 3000u);
  expectNothingBetween(volume, sized.grid);

  ConvertOptions options = optionsFor(FitGoal{});
  options.fit.count = 200;
  const Conversion fitted = convertVolume({kDescriptor, volume}, options);
  EXPECT_GT(psnrOf(volume, fitted.grid), 30.0) << "relative to 0, the border takes all ellipsoids";
  expectNothingBetween(volume, fitted.grid);
}

// A quality relative to the range of such values would ask for their roundings.
TEST(Constant, TakesNoBytesForItsRoundings) {
  std::uint32_t bits = 1;
  const SparseVolume volume = test::volumeOf({}, 3, 0.0f, [&](Coord) {
    bits = bits * 1664525u + 1013904223u;
    return std::nextafter(293.15f, bits & 0x10000 ? 0.0f : 1000.0f);
  });
  for (const Goal& goal : std::vector<Goal>{PresetGoal{}, PsnrGoal{40.0}, PictureGoal{40.0}}) {
    const Conversion made = converted(volume, goal, Representation::kAuto);
    EXPECT_LT(bytesAdded(made.grid), 400u);
    EXPECT_LT(compareVolumes(volume, decodeGrid(made.grid)).maxError, 1e-4);
  }
  EXPECT_GT(bytesAdded(converted(volume, PsnrGoal{200.0}, Representation::kAuto).grid), 1000u);
  EXPECT_GE(psnrOf(volume, converted(volume, PsnrGoal{40.0}).grid), 40.0) << "as ellipsoids";
}

TEST(FarBackground, IsStoredAsItIsWithoutLoss) {
  const SparseVolume volume = pressureVolume();
  const Conversion made = converted(volume, LosslessGoal{}, Representation::kVoxels);
  EXPECT_FALSE(made.grid.farBackground);
  EXPECT_EQ(largestDifference(volume, decodeGrid(made.grid)), 0.0);
}

TEST(FarBackground, OfThePreviousFrameIsKeptIfItIsAmongTheValues) {
  const SparseVolume before = pressureVolume();
  SparseVolume after = before;
  for (std::size_t b = 0; b < after.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      if (after.active[b].test(v)) after.brickValues(b)[std::size_t(v)] += 1.0f;
  ConvertOptions options = optionsFor(PsnrGoal{40.0});
  options.representation = Representation::kVoxels;
  const StoredGrid first = convertVolume({kDescriptor, before}, options).grid;
  options.previous = &first;
  const StoredGrid second = convertVolume({kDescriptor, after}, options).grid;
  EXPECT_EQ(second.field.background, first.field.background);
  expectNothingBetween(after, second);
  EXPECT_GE(psnrOf(after, second), 40.0);
}

TEST(FarBackground, TakesNoThresholdAndNeedsADecoding) {
  const StoredGrid grid =
      converted(pressureVolume(), PsnrGoal{30.0}, Representation::kEllipsoids).grid;
  EXPECT_THROW((void)decodeGrid(grid, {.threshold = 1.0f}), UsageError);
  EXPECT_FALSE(followsFromEllipsoids(grid));
}

TEST(ConvertVolume, RefusesVoxelsThatLieTooFarApartForAFile) {
  const auto twoBricks = [](std::int32_t distance) {
    BrickInput first{{0, 0, 0}, {}, {}}, second{{distance, 0, 0}, {}, {}};
    for (BrickInput* brick : {&first, &second}) brick->values[0] = 1.0f, brick->active.set(0);
    return makeVolume({first, second}, 0.0f);
  };
  constexpr std::int32_t kTooFar = 1 << 24;
  EXPECT_EQ(
      decodeGrid(
          converted(twoBricks(kTooFar - kBrickSide), LosslessGoal{}, Representation::kVoxels).grid)
          .brickCount(),
      2u);
  for (const Goal& goal : {Goal{LosslessGoal{}}, Goal{PresetGoal{}}, Goal{FitGoal{}}}) try {
      (void)converted(twoBricks(kTooFar), goal, Representation::kAuto);
      FAIL();
    } catch (const CannotConvert& error) {
      EXPECT_NE(std::string(error.what()).find("to (16777216, 0, 0): 2^24 voxels or more"),
                std::string::npos);
    }
}

TEST(FarBackground, IsNotThatOfAScanFromAThresholdOn) {
  const SparseVolume scan = test::volumeOf({}, 4, 0.0f, [](Coord v) {
    const double r = std::hypot(v.x - 15.5, v.y - 15.5, v.z - 15.5);
    return r < 12.0 ? float(1.0 - 0.07 * r) : 0.0f;
  });
  const Conversion made = converted(scan, PsnrGoal{35.0}, Representation::kVoxels);
  EXPECT_FALSE(made.grid.farBackground);
  EXPECT_EQ(made.grid.field.background, 0.0f);
}

}  // namespace
}  // namespace esvr
