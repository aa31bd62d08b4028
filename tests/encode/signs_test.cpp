// Plan: balls and cubes with several half widths, also with a band that is wider outside than inside,
// and at two scales of values, are converted for every goal and representation. No voxel may change
// sign, which a flood fill of the empty space (EmptySigns) extends to the space without bricks. The
// search is for values close to 0, which rounding would move to the other side: each band has some.
// A level set with a hole, one without a negative value and one whose values exceed its background
// are converted like other grids, but for their surface, which is kept whatever values are far from it.
// Plan: a residual gives every voxel of a narrow band the sign of its source, also for the rounding
// differences of another machine, and belongs to all of the ellipsoids.

#include "encode/signs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <tuple>

#include "../field/random_field.h"
#include "../fit/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/volume.h"
#include "support/messages.h"

namespace esvr {
namespace {

using encode::changeAcrossSurface;
using encode::withSigns;
using Distance = std::function<double(Coord)>;

double toBall(Coord v) { return std::hypot(v.x - 23.5, v.y - 23.4, v.z - 23.3) - 15.0; }

double toCube(Coord v) {
  return std::max({std::abs(v.x - 23.5), std::abs(v.y - 23.4), std::abs(v.z - 23.3)}) - 13.48;
}

/// The half widths of a band, in voxels, and the size of a voxel.
struct Band {
  double outside = 3.0, inside = 3.0, voxelSize = 1.0;
};

SparseVolume levelSetOf(const Distance& distance, const Band& band) {
  const auto background = float(band.outside * band.voxelSize);
  std::vector<BrickInput> bricks;
  for (int b = 0; b < 6 * 6 * 6; ++b) {
    BrickInput brick{Coord{b / 36, b / 6 % 6, b % 6} * kBrickSide, {}, {}};
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double d = distance(brick.corner + voxelLocal(v));
      const bool active = d < band.outside && d > -band.inside;
      brick.values[std::size_t(v)] =
          active ? float(d * band.voxelSize) : std::copysign(background, float(d));
      if (active) brick.active.set(v);
    }
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), background);
}

GridDescriptor levelSet(const SparseVolume& volume) {
  GridDescriptor descriptor;
  descriptor.name = "surface";
  descriptor.gridClass = GridClass::kLevelSet;
  descriptor.background = volume.background;
  return descriptor;
}

Conversion bandOf(const SparseVolume& volume, const Goal& goal,
                  Representation representation = Representation::kAuto) {
  ConvertOptions options;
  options.goal = goal;
  options.representation = representation;
  options.fit.iterations = 60;
  options.fit.count = 60;
  options.fit.preset = Preset::kDraft;
  return convertVolume({levelSet(volume), volume}, options);
}

void expectSameSigns(const SparseVolume& volume, const StoredGrid& grid) {
  const SparseVolume decoded = decodeGrid(grid);
  EXPECT_EQ(compareSigns(volume, decoded).voxels, 0u);
  EXPECT_TRUE(EmptySigns(decoded).agree());
}

class NarrowBand : public testing::TestWithParam<std::tuple<bool, Band>> {
 protected:
  SparseVolume volume_ = levelSetOf(std::get<0>(GetParam()) ? Distance(toBall) : Distance(toCube),
                                    std::get<1>(GetParam()));
  double voxel_ = std::get<1>(GetParam()).voxelSize;
};

TEST_P(NarrowBand, KeepsTheSignsOfVoxels) {
  ASSERT_TRUE(isNarrowBand(levelSet(volume_), volume_));
  const auto nearest =
      *std::ranges::min_element(volume_.values, {}, [](float v) { return std::abs(v); });
  ASSERT_LT(std::abs(nearest), 0.05 * voxel_) << "rounding has no sign to change";
  for (const Goal& goal :
       {Goal{PsnrGoal{20.0}}, Goal{PsnrGoal{30.0}}, Goal{PsnrGoal{40.0}}, Goal{PsnrGoal{50.0}},
        Goal{PresetGoal{}}, Goal{BoundGoal{0.4 * voxel_}}, Goal{BoundGoal{0.02, true}},
        Goal{SizeGoal{2500}}, Goal{LosslessGoal{}}}) {
    const Conversion conversion = bandOf(volume_, goal, Representation::kVoxels);
    EXPECT_TRUE(conversion.grid.voxels);
    expectSameSigns(volume_, conversion.grid);
  }
}

TEST_P(NarrowBand, SlowKeepsTheSignsOfEllipsoids) {
  for (const Goal& goal : {Goal{FitGoal{}}, Goal{SizeGoal{8000}}}) {
    const Conversion conversion = bandOf(volume_, goal, Representation::kEllipsoids);
    EXPECT_FALSE(conversion.grid.voxels);
    EXPECT_TRUE(conversion.grid.residual) << "no sign had to be corrected";
    expectSameSigns(volume_, conversion.grid);
    if (std::holds_alternative<SizeGoal>(goal)) {
      EXPECT_LE(bytesAdded(conversion.grid), 8000u);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, NarrowBand,
                         testing::Combine(testing::Bool(),
                                          testing::Values(Band{}, Band{1.5, 1.5}, Band{3.0, 1.5},
                                                          Band{3.0, 3.0, 0.01},
                                                          Band{3.0, 3.0, 100.0})));

TEST(NarrowBandChoice, SaysWhatDoesNotFitIntoASmallSize) {
  try {
    (void)bandOf(levelSetOf(toBall, {}), SizeGoal{650});
    FAIL() << "650 bytes hold the signs";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("corrects the signs"),
                                             testing::HasSubstr("650 bytes, and voxels neither")));
  }
}

TEST(NarrowBandChoice, SlowKeepsTheSignsOfWhatIsStored) {
  const SparseVolume volume = levelSetOf(toBall, {});
  for (const Goal& goal :
       {Goal{PsnrGoal{35.0}}, Goal{PresetGoal{}}, Goal{SizeGoal{1200}}, Goal{SizeGoal{6000}}}) {
    const Conversion conversion = bandOf(volume, goal);
    expectSameSigns(volume, conversion.grid);
    if (const auto* size = std::get_if<SizeGoal>(&goal)) {
      EXPECT_LE(bytesAdded(conversion.grid), size->bytes);
    }
  }
}

TEST(NarrowBandChoice, KnowsTheRoomForItsSignsBeforeTheFirstWholeFit) {
  const SparseVolume volume = levelSetOf(toBall, {});
  ConvertOptions options{.goal = SizeGoal{5000}, .representation = Representation::kEllipsoids};
  double last = 2.0;
  int fits = 0;
  options.fit.iterations = 120;
  options.fit.progress = [&](const FitProgress& progress) {
    fits += progress.fraction < last;
    last = progress.fraction;
  };
  const Conversion made = convertVolume({levelSet(volume), volume}, options);
  EXPECT_TRUE(made.grid.residual);
  EXPECT_LE(bytesAdded(made.grid), 5000u);
  EXPECT_LE(fits, 3) << "one short fit, and two whole ones";
  expectSameSigns(volume, made.grid);
}

TEST(NarrowBandBound, IsKeptNearTheSurface) {
  const SparseVolume volume = levelSetOf(toBall, {});
  for (const double bound : {0.5, 0.1, 0.01})
    EXPECT_LE(largestDifference(volume, decodeGrid(bandOf(volume, BoundGoal{bound}).grid)), bound);
}

TEST(OtherLevelSets, AreConvertedLikeOtherGrids) {
  const SparseVolume open = levelSetOf(toBall, {});
  // Without a brick above the center of the ball.
  std::vector<BrickInput> bricks;
  for (std::size_t b = 0; b < open.brickCount(); ++b) {
    BrickInput brick{open.brickCorner(b), {}, open.active[b]};
    std::ranges::copy(open.brickValues(b), brick.values.begin());
    if (brick.corner.x != 16 || brick.corner.y != 16 || brick.corner.z > 23)
      bricks.push_back(brick);
  }
  const SparseVolume hole = makeVolume(std::move(bricks), open.background);
  ASSERT_LT(hole.brickCount(), open.brickCount());
  SparseVolume unsignedBand = open;
  for (float& v : unsignedBand.values) v = std::abs(v);
  const SparseVolume wide = levelSetOf(toBall, {.outside = 2.0, .inside = 4.0});
  for (const SparseVolume* volume :
       std::array<const SparseVolume*, 3>{&hole, &unsignedBand, &wide}) {
    EXPECT_FALSE(isNarrowBand(levelSet(*volume), *volume));
    EXPECT_FALSE(whyNoNarrowBand(levelSet(*volume), *volume).empty());
    const Conversion conversion = bandOf(*volume, PsnrGoal{30.0}, Representation::kVoxels);
    EXPECT_TRUE(conversion.grid.voxels);
  }
  // No sum has the inside of a surface with a hole.
  const auto fitted = [&](const Goal& goal) {
    return bandOf(hole, goal, Representation::kEllipsoids);
  };
  EXPECT_THAT([&] { (void)fitted(PsnrGoal{40.0}); },
              test::ThrowsSaying<BadInput>("ellipsoids reach at most"));
  // Its active voxels can be fitted nevertheless.
  EXPECT_GE(compareVolumes(hole, decodeGrid(fitted(PresetGoal{}).grid)).psnrActive, 30.0);
}

TEST(RequireSigns, NamesTheGridAndTheVoxel) {
  const SparseVolume volume = levelSetOf(toBall, {});
  const GridDescriptor descriptor = levelSet(volume);
  SparseVolume other = volume;
  EXPECT_NO_THROW(encode::requireSigns({descriptor, volume}, other));
  other.values[0] = -other.values[0];
  try {
    encode::requireSigns({descriptor, volume}, other);
    FAIL();
  } catch (const RuntimeFailure& failure) {
    const std::string text = failure.what();
    EXPECT_NE(text.find("'surface'"), std::string::npos);
    EXPECT_NE(text.find(toString(volume.brickCorner(0))), std::string::npos);
  }
}

/// A level set that few ellipsoids restore badly.
StoredGrid roughBand(const SparseVolume& volume) {
  FitOptions options;
  options.count = 40;
  options.iterations = 40;
  options.kappa = 2.0f;
  options.narrowBand = true;
  GridDescriptor levelSet;
  levelSet.gridClass = GridClass::kLevelSet;
  levelSet.background = volume.background;
  return makeStoredGrid(levelSet, volume, fit(volume, options).field);
}

std::uint64_t wrongSigns(const SparseVolume& volume, const StoredGrid& grid) {
  const auto bytes = encodeEsvr({{}, {grid}});
  return compareSigns(volume, decodeGrid(decodeEsvr(bytes, "memory").grids[0])).voxels;
}

TEST(WithSigns, GivesEveryVoxelItsSign) {
  const SparseVolume volume = test::levelSetVolume();
  const StoredGrid rough = roughBand(volume), right = withSigns(rough, volume);
  EXPECT_GT(wrongSigns(volume, rough), 0u);
  ASSERT_TRUE(right.residual);
  EXPECT_EQ(wrongSigns(volume, right), 0u);
}

/// Changes of intensities in the last places move the sum as another machine's evaluation does.
TEST(WithSigns, HoldsForASumThatRoundsDifferently) {
  const SparseVolume volume = test::levelSetVolume();
  StoredGrid grid = withSigns(roughBand(volume), volume);
  test::Random random(3);
  for (float& intensity : grid.field.chunks[0].ellipsoids.intensity)
    intensity *= float(1.0 + random(-4e-6, 4e-6));
  EXPECT_EQ(wrongSigns(volume, grid), 0u);
}

TEST(WithSigns, BelongsToAllOfTheEllipsoids) {
  const SparseVolume volume = test::levelSetVolume();
  const StoredGrid grid = withSigns(roughBand(volume), volume);
  EXPECT_TRUE(heaviest(grid, 1000).residual);
  EXPECT_FALSE(heaviest(grid, 3).residual);
}

// ---- Level sets that are no narrow bands

/// A ball whose distances are truncated outside, with markers far from it, in a box of active voxels and by default
/// with a background of 0, as simulations store obstacles.
SparseVolume obstacle(float marker, float background = 0.0f) {
  std::vector<BrickInput> bricks;
  for (int b = 0; b < 6 * 6 * 6; ++b) {
    BrickInput brick{Coord{b / 36, b / 6 % 6, b % 6} * kBrickSide, {}, {}};
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = brick.corner + voxelLocal(v);
      const bool isBorder = at.x == 0 || at.y == 0 || at.z == 0;
      brick.values[std::size_t(v)] = isBorder ? marker : float(std::min(0.5 * toBall(at), 2.5));
      brick.active.set(v);
    }
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), background);
}

TEST(Surface, ChangesByTheSizeOfAVoxel) {
  EXPECT_NEAR(*changeAcrossSurface(obstacle(1e4f)), 0.4, 0.1);
  EXPECT_EQ(changeAcrossSurface(obstacle(1e4f)), changeAcrossSurface(obstacle(2.5f)));
  SparseVolume outside = obstacle(1e4f);
  for (float& value : outside.values) value = std::abs(value);
  EXPECT_EQ(changeAcrossSurface(outside), std::nullopt);
}

TEST(Surface, IsKeptBesideMarkersOfAnySize) {
  double bytes = 0.0;
  for (const float marker : {2.5f, 1e4f, 1e30f}) {
    const SparseVolume volume = obstacle(marker);
    ASSERT_FALSE(isNarrowBand(levelSet(volume), volume));
    const Conversion made = convertVolume({levelSet(volume), volume}, {.goal = PresetGoal{}});
    ASSERT_TRUE(made.surfaceBound);
    const double bound = qualityOf(Preset::kStandard).surfaceBound * *changeAcrossSurface(volume);
    EXPECT_EQ(*made.surfaceBound, bound);
    EXPECT_LE(largestDifference(volume, decodeGrid(made.grid)), bound);
    EXPECT_EQ(compareSigns(volume, decodeGrid(made.grid)).voxels, 0u);
    if (marker < 1e30f) bytes = std::max(bytes, double(bytesAdded(made.grid)));
  }
  EXPECT_LT(bytes, 0.1 * 4.0 * 48 * 48 * 48);
}

TEST(Surface, OfABandIsJudgedWhereThePsnrSaysNothingOfIt) {
  const SparseVolume usual = test::levelSetVolume();
  EXPECT_FALSE(bandOf(usual, PresetGoal{}).surfaceBound);
  for (const float marker : {1e4f, 1e30f}) {
    const SparseVolume volume = obstacle(marker, marker);
    ASSERT_TRUE(isNarrowBand(levelSet(volume), volume));
    const Conversion made = convertVolume({levelSet(volume), volume}, {.goal = PresetGoal{}});
    ASSERT_TRUE(made.surfaceBound);
    EXPECT_LE(largestDifference(volume, decodeGrid(made.grid)), *made.surfaceBound);
    EXPECT_EQ(compareSigns(volume, decodeGrid(made.grid)).voxels, 0u);
  }
}

TEST(Surface, OfASizeKeepsItsSigns) {
  const SparseVolume volume = obstacle(1e4f);
  const Conversion made = convertVolume({levelSet(volume), volume}, {.goal = SizeGoal{5000}});
  EXPECT_TRUE(made.grid.voxels);
  EXPECT_LE(bytesAdded(made.grid), 5000u);
  EXPECT_EQ(compareSigns(volume, decodeGrid(made.grid)).voxels, 0u);
}

TEST(Surface, IsNoMeasureOfOtherGoalsAndGrids) {
  const SparseVolume volume = obstacle(1e4f);
  EXPECT_FALSE(convertVolume({levelSet(volume), volume}, {.goal = BoundGoal{0.3}}).surfaceBound);
  GridDescriptor fog = levelSet(volume);
  fog.gridClass = GridClass::kUnknown;
  EXPECT_FALSE(convertVolume({fog, volume}, {.goal = SizeGoal{5000}}).surfaceBound);
}

}  // namespace
}  // namespace esvr
