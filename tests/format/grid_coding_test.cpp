// Plan: sources are made from fields whose voxels are known. The same field with its threshold
// gives the same voxels. A different field gives the best overlap that an exhaustive search over
// all thresholds finds, and no threshold that increases the squared error. The active box is always
// that of the source. Level sets give their band and their inside, and grids without contrast give
// their bricks.

#include "esvr/grid_coding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/metrics.h"
#include "field/random_field.h"
#include "fit/volumes.h"

namespace esvr::test {
namespace {

GridDescriptor descriptorOf(GridClass gridClass, double background) {
  GridDescriptor descriptor;
  descriptor.name = "a grid";
  descriptor.gridClass = gridClass;
  descriptor.background = background;
  return descriptor;
}
const GridDescriptor kFog = descriptorOf(GridClass::kFogVolume, 0.0);
const GridDescriptor kLevelSet = descriptorOf(GridClass::kLevelSet, 3.0);

Field positiveField(std::uint64_t seed, Coord origin = {}) {
  Field field = randomField({.count = 20, .extent = 30.0, .origin = origin, .seed = seed});
  for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i) + 0.1f;
  return field;
}

/// A field that differs from the one of the source, for an overlap below 1.
Field perturbed(Field field) {
  Random random(11);
  for (float& x : field.chunks[0].ellipsoids.center[0]) x += float(random(-1.0, 1.0));
  return field;
}

/// A round body with a negative inside: V falls from 3 to -3 as a signed distance would.
Field ball(float background = 3.0f) {
  Field field;
  field.background = background;
  field.kernel.kappa = 2.0f;
  field.chunks.resize(1);
  Ellipsoids& e = field.chunks[0].ellipsoids;
  e.resize(1);
  for (auto& c : e.center) c[0] = 20.0f;
  for (auto& s : e.logScale) s[0] = std::log(4.0f);
  e.rotation[0][0] = 1.0f;
  e.intensity[0] = -3.0f * background;
  return field;
}

SparseVolume oneBrick(float value, const BrickMask& active, float background = 0.0f) {
  BrickInput brick{{-8, 0, 16}, {}, active};
  brick.values.fill(background);
  for (int v = 0; v < kBrickVoxels; ++v)
    if (active.test(v)) brick.values[v] = value;
  return makeVolume({brick}, background);
}

BrickMask firstVoxels(int count) {
  BrickMask mask;
  for (int v = 0; v < count; ++v) mask.set(v);
  return mask;
}

VolumeMetrics decodedAt(const StoredGrid& grid, const SparseVolume& source, float threshold) {
  return compareVolumes(source, decodeGrid(grid, {.threshold = threshold}));
}

TEST(GridCoding, FactsOfTheSourceAreStored) {
  const Field field = positiveField(1, {-100, 8, 64});
  const SparseVolume source = revoxelise(field, {.threshold = 0.05f});
  const StoredGrid grid = makeStoredGrid(kFog, source, field);
  const ValueRange range = activeRange(source);
  EXPECT_EQ(grid.descriptor, kFog);
  EXPECT_EQ(grid.activeBox, activeBox(source));
  EXPECT_EQ(grid.activeVoxels, activeVoxelCount(source));
  EXPECT_EQ(grid.valueMin, range.min);
  EXPECT_EQ(grid.valueMax, range.max);
  EXPECT_TRUE(grid.withinRange);
  EXPECT_EQ(grid.topology, TopologyKind::kThreshold);
  EXPECT_TRUE(grid.bricks.empty());
}

// The thresholds are edges of bins, which floats represent exactly, so that the source's threshold
// can be met.
TEST(GridCoding, SaysWhatFloat32EvaluatesImprecisely) {
  const Field field = positiveField(3);
  const StoredGrid usual = makeStoredGrid(kFog, revoxelise(field, {}), field);
  EXPECT_EQ(whyImprecise(usual), "");
  StoredGrid sharp = usual, cancelling = usual;
  sharp.field.kernel.kappa = 5000.0f;
  EXPECT_EQ(whyImprecise(sharp),
            "an edge has a sharpness of 5000, for which float32 has few digits");
  auto& intensity = cancelling.field.chunks[0].ellipsoids.intensity;
  const double peak = std::max(std::abs(usual.valueMin), std::abs(usual.valueMax));
  intensity[0] = float(1900.0 * peak), intensity[1] = -intensity[0];
  EXPECT_EQ(whyImprecise(cancelling), "");
  intensity[0] = float(4096.0 * peak), intensity[1] = -intensity[0];
  EXPECT_EQ(whyImprecise(cancelling),
            "its ellipsoids are 4096 times as large as its values and cancel each other, for which "
            "float32 has few digits");
}

TEST(GridCoding, AFieldThatFitsGivesItsSourceBack) {
  for (const float threshold : {0.0f, 0.0625f, 0.5f}) {
    const Field field = positiveField(2);
    const SparseVolume source = revoxelise(field, {.threshold = threshold});
    EXPECT_EQ(volumeDifference(source, decodeGrid(makeStoredGrid(kFog, source, field))), "");
  }
}

TEST(GridCoding, TheThresholdOverlapsAsWellAsTheBestOfManyThatCostNoError) {
  const Field truth = positiveField(3);
  const SparseVolume source = revoxelise(truth, {.threshold = 0.2f});
  const StoredGrid grid = makeStoredGrid(kFog, source, perturbed(truth), Activity::kByValue);
  const double mseOfAll = decodedAt(grid, source, 0.0f).mseBox;

  double bestIou = 0.0;
  for (float t = 0.001f; t < 1.0f; t *= 1.1f) {
    const VolumeMetrics m = decodedAt(grid, source, t);
    if (m.mseBox <= mseOfAll) bestIou = std::max(bestIou, m.iou);
  }
  const VolumeMetrics chosen = compareVolumes(source, decodeGrid(grid));
  ASSERT_LT(bestIou, 0.99);
  // A bin covers up to 1/128 of its threshold, which contains less than 0.01 of these voxels.
  EXPECT_GE(chosen.iou, bestIou - 0.01);
  EXPECT_GT(chosen.iou, decodedAt(grid, source, 0.0f).iou);
  EXPECT_LE(chosen.mseBox, 1.001 * mseOfAll);
}

TEST(GridCoding, TheThresholdIsTheSameElsewhereAndScalesWithTheValues) {
  const float scale = 0x1p-40f;
  const Field here = positiveField(4);
  Field there = here, faint = here;
  there.chunks[0].origin = {1 << 20, -(1 << 20), 0};
  for (float& i : faint.chunks[0].ellipsoids.intensity) i *= scale;

  const auto thresholdOf = [](const Field& field, float cut) {
    return makeStoredGrid(kFog, revoxelise(field, {.threshold = cut}), perturbed(field),
                          Activity::kByValue)
        .activeThreshold;
  };
  const float threshold = thresholdOf(here, 0.1f);
  EXPECT_GT(threshold, 0.0f);
  EXPECT_EQ(thresholdOf(there, 0.1f), threshold);
  // There is one more threshold than bins below each power of two, so the edge itself differs by
  // one ulp.
  EXPECT_FLOAT_EQ(thresholdOf(faint, 0.1f * scale), threshold * scale);
}

TEST(GridCoding, NegativeValuesComeBackOnlyWhereTheSourceHadThem) {
  const Field field = randomField({.count = 20, .extent = 30.0});
  const SparseVolume withNegative = revoxelise(field, {});
  const SparseVolume without = revoxelise(field, {.range = ValueRange{0.0f, 1e6f}});
  ASSERT_LT(activeRange(withNegative).min, 0.0f);
  EXPECT_LT(activeRange(decodeGrid(makeStoredGrid(kFog, withNegative, field))).min, 0.0f);
  EXPECT_GE(activeRange(decodeGrid(makeStoredGrid(kFog, without, field))).min, 0.0f);
}

TEST(GridCoding, NoValueComesBackBeyondThoseOfTheSource) {
  const Field field = positiveField(5);
  const ValueRange half{0.0f, activeRange(revoxelise(field, {})).max / 2.0f};
  const SparseVolume source = revoxelise(field, {.range = half});
  const StoredGrid grid = makeStoredGrid(kFog, source, field);
  EXPECT_EQ(volumeDifference(source, decodeGrid(grid)), "");
  EXPECT_EQ(activeRange(decodeGrid(grid)).max, half.max);
}

TEST(GridCoding, TheBackgroundIsNeverCutOff) {
  Field field = positiveField(6);
  field.background = -5.0f;
  for (float& i : field.chunks[0].ellipsoids.intensity) i += 5.0f;
  const SparseVolume source = revoxelise(field, {.threshold = 5.0f});
  ASSERT_GT(activeRange(source).min, -5.0f);
  const SparseVolume all = decodeGrid(makeStoredGrid(kFog, source, field), {.threshold = 0.0f});
  EXPECT_LT(activeRange(all).min, -4.9f);
}

TEST(GridCoding, ALevelSetGivesItsBandAndItsInsideBack) {
  const Field field = ball();
  const SparseVolume source = revoxelise(field, {.threshold = 0.25f, .narrowBand = true});
  const Coord inside{20, 20, 20};
  ASSERT_EQ(valueAt(source, {31, 20, 20}), 3.0f);
  EXPECT_TRUE(isNarrowBand(kLevelSet, source));
  EXPECT_FALSE(isNarrowBand(kFog, source));
  const StoredGrid grid = makeStoredGrid(kLevelSet, source, field);
  EXPECT_EQ(grid.topology, TopologyKind::kBricks);
  EXPECT_EQ(grid.bricks.size(), source.brickCount());

  const SparseVolume decoded = decodeGrid(grid);
  EXPECT_EQ(volumeDifference(source, decoded), "");
  EXPECT_EQ(valueAt(decoded, inside), -3.0f);
}

TEST(GridCoding, AQuantisedLevelSetHasItsBackgroundOnBothSidesOfItsBand) {
  const SparseVolume source = revoxelise(ball(), {.threshold = 0.25f, .narrowBand = true});
  ASSERT_EQ(valueAt(source, {20, 20, 20}), -3.0f);
  const VoxelLayer layer = nearestLayer(source, 0.4, Activity::kExact);  // 3 is no multiple of 0.8
  ASSERT_NE(valueAt(volumeOf(layer), {20, 20, 20}), -3.0f);
  const SparseVolume decoded = decodeGrid(makeStoredVoxels(kLevelSet, source, layer));
  for (std::size_t b = 0; b < source.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      if (!source.active[b].test(v)) {
        EXPECT_EQ(valueAt(decoded, source.brickCorner(b) + voxelLocal(v)),
                  source.brickValues(b)[v]);
      }
}

TEST(GridCoding, ALevelSetStaysWithinTheBricksOfItsSource) {
  const Field field = ball();
  const SparseVolume source = revoxelise(field, {.narrowBand = true});
  Field two = field;  // another ball, whose bricks the source does not have
  two.chunks.push_back(field.chunks.front());
  two.chunks.back().origin.x += 64;
  ASSERT_GT(revoxelise(two, {.narrowBand = true}).brickCount(), source.brickCount());
  EXPECT_EQ(decodeGrid(makeStoredGrid(kLevelSet, source, two)).bricks, source.bricks);
}

TEST(GridCoding, ADistanceFieldThatIsActiveBeyondItsBandIsNotCutToIt) {
  const Field field = ball();
  const SparseVolume source = revoxelise(field, {});
  ASSERT_LT(activeRange(source).min, -3.0f);
  EXPECT_FALSE(isNarrowBand(kLevelSet, source));
  const StoredGrid grid = makeStoredGrid(kLevelSet, source, field);
  EXPECT_EQ(grid.topology, TopologyKind::kThreshold);
  EXPECT_EQ(volumeDifference(source, decodeGrid(grid)), "");
}

TEST(GridCoding, ValuesThatEqualTheBackgroundKeepTheirBricks) {
  for (const float value : {0.0f, 1.0f}) {
    Field nothing;
    nothing.background = value;
    const SparseVolume source = oneBrick(value, firstVoxels(3), value);
    const StoredGrid grid = makeStoredGrid(kFog, source, nothing);
    const EsvrFile stored = decodeEsvr(encodeEsvr({{}, {grid}}), "memory");
    EXPECT_EQ(volumeDifference(decodeGrid(stored.grids[0]), source), "");
  }
}

TEST(GridCoding, TheMaskComesBackBitForBitWhereItIsStored) {
  const Field field = positiveField(5);
  SparseVolume source = revoxelise(field, {.threshold = 0.01f});
  // The mask has holes that no threshold finds, and a voxel that no ellipsoid reaches.
  for (auto& mask : source.active) mask.words[3] &= 0x5555555555555555;
  const StoredGrid grid = makeStoredGrid(kFog, source, field, Activity::kExact);
  EXPECT_EQ(grid.topology, TopologyKind::kMask);
  const auto bytes = encodeEsvr({{}, {grid}});
  const EsvrFile stored = decodeEsvr(bytes, "memory");
  EXPECT_EQ(encodeEsvr(stored), bytes);
  const SparseVolume decoded = decodeGrid(stored.grids[0]);
  EXPECT_EQ(decoded.bricks, source.bricks);
  EXPECT_EQ(decoded.active, source.active);
  EXPECT_EQ(decodeGrid(grid, {.threshold = 0.1f}).active,
            revoxelise(field, {.threshold = 0.1f, .box = grid.activeBox}).active);
}

/// True if no voxel of `a` is active outside the active box of `b`.
bool staysWithin(const SparseVolume& a, const SparseVolume& b) {
  const Box box = activeBox(b), all = activeBox(a);
  return all.empty() || (box.contains(all.min) && box.contains(all.max));
}

// The ellipsoids reach beyond the voxels of the source, whose upper half is cut off.
TEST(GridCoding, NoVoxelOutsideTheActiveBoxIsActive) {
  for (const Coord origin : {Coord{}, Coord{10'000'000, -10'000'000, 8}}) {
    const Field field = positiveField(7, origin);
    SparseVolume source = revoxelise(field, {.threshold = 0.05f});
    const Box all = activeBox(source);
    const Coord half{all.max.x, all.max.y, (all.min.z + all.max.z) / 2};
    source = revoxelise(field, {.threshold = 0.05f, .box = {all.min, half}});
    ASSERT_EQ(activeBox(source).max.z, half.z);
    ASSERT_FALSE(staysWithin(revoxelise(field, {.threshold = 0.05f}), source));
    for (const auto activity : {Activity::kByValue, Activity::kExact}) {
      const StoredGrid grid = makeStoredGrid(kFog, source, field, activity);
      EXPECT_EQ(volumeDifference(decodeGrid(grid), source), "");
    }
  }
}

// With the high thresholds, hardly a voxel is left; without ellipsoids, none but those of the box.
TEST(GridCoding, TheActiveBoxIsThatOfTheSourceWhateverTheFit) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Coord origin{std::int32_t(seed) * 1'000'000, -7, 30'000};
    const Field truth = positiveField(seed, origin);
    for (const float threshold : {0.0f, 0.003f, 0.2f}) {
      const SparseVolume source = revoxelise(truth, {.threshold = threshold});
      StoredGrid grid = makeStoredGrid(kFog, source, perturbed(truth));
      EXPECT_LE(grid.boxVoxels.size(), kMostBoxVoxels);
      for (const float stored : {grid.activeThreshold, 1.0f, 100.0f}) {
        grid.activeThreshold = stored;
        const EsvrFile read = decodeEsvr(encodeEsvr({{}, {grid}}), "memory");
        EXPECT_EQ(activeBox(decodeGrid(read.grids[0])), activeBox(source)) << seed << ' ' << stored;
      }
      grid.field.chunks.clear();
      EXPECT_EQ(activeBox(decodeGrid(grid)), activeBox(source)) << seed;
    }
  }
}

TEST(GridCoding, ABandKeepsItsActiveBox) {
  const Field field = ball();
  const SparseVolume source = revoxelise(field, {.threshold = 0.25f, .narrowBand = true});
  StoredGrid grid = makeStoredGrid(kLevelSet, source, field);
  ASSERT_EQ(grid.topology, TopologyKind::kBricks);
  grid.activeThreshold = 2.9f;
  EXPECT_EQ(activeBox(decodeGrid(grid)), activeBox(source));
}

TEST(GridCoding, BoxVoxelsHaveTheValuesOfTheSum) {
  const Field field = positiveField(3);
  const SparseVolume source = revoxelise(field, {.threshold = 0.0f});
  StoredGrid grid = makeStoredGrid(kFog, source, field);
  grid.activeThreshold = 1000.0f;
  const SparseVolume decoded = decodeGrid(grid);
  EXPECT_EQ(activeVoxelCount(decoded), grid.boxVoxels.size());
  for (const Coord voxel : grid.boxVoxels)
    EXPECT_EQ(valueAt(decoded, voxel), valueAt(source, voxel)) << toString(voxel);
}

TEST(GridCoding, APartHasTheBoxVoxelsWithinIt) {
  const Field field = positiveField(3);
  StoredGrid grid = makeStoredGrid(kFog, revoxelise(field, {}), field);
  grid.activeThreshold = 1000.0f;
  for (const Coord voxel : grid.boxVoxels) {
    const SparseVolume part = decodeGrid(grid, {.box = Box{voxel, voxel}});
    EXPECT_EQ(activeBox(part), (Box{voxel, voxel}));
  }
}

TEST(GridCoding, BoxVoxelsThatAreImpossibleAreRefused) {
  const Field field = positiveField(3);
  const StoredGrid good = makeStoredGrid(kFog, revoxelise(field, {}), field);
  const Box box = good.activeBox;
  StoredGrid outside = good, unsorted = good, many = good, masked = good;
  outside.boxVoxels = {box.min - Coord{1, 0, 0}};
  unsorted.boxVoxels = {box.max, box.min};
  many.boxVoxels.clear();
  for (int n = 0; n < 7; ++n) many.boxVoxels.push_back(box.min + Coord{0, 0, n});
  masked = makeStoredGrid(kFog, revoxelise(field, {}), field, Activity::kExact);
  masked.boxVoxels = good.boxVoxels;
  EXPECT_NO_THROW((void)encodeEsvr({{}, {good}}));
  for (const StoredGrid* grid : {&outside, &unsorted, &many, &masked})
    EXPECT_THROW((void)encodeEsvr({{}, {*grid}}), RuntimeFailure);
}

TEST(GridCoding, AThresholdTakesFewerBytesThanAMask) {
  const Field field = positiveField(3);
  const SparseVolume source = revoxelise(field, {.threshold = 0.001f});
  const auto bytesOf = [&](Activity activity) {
    return bytesAdded(makeStoredGrid(kFog, source, perturbed(field), activity));
  };
  EXPECT_LT(bytesOf(Activity::kByValue) + 300, bytesOf(Activity::kExact));
}

TEST(GridCoding, AVoxelThatNoEllipsoidReachesIsStored) {
  Field nothing;
  const SparseVolume source = oneBrick(2.0f, firstVoxels(1));
  const SparseVolume decoded = decodeGrid(makeStoredGrid(kFog, source, nothing));
  EXPECT_EQ(decoded.bricks, source.bricks);
  EXPECT_EQ(decoded.active, source.active);
}

TEST(GridCoding, APartOfAMaskIsDecodedAsInTheWhole) {
  const Field field = positiveField(5);
  const StoredGrid grid =
      makeStoredGrid(kFog, revoxelise(field, {}), perturbed(field), Activity::kExact);
  ASSERT_EQ(grid.topology, TopologyKind::kMask);
  const Box all = grid.activeBox, box{all.min + Coord{3, 3, 3}, all.max - Coord{9, 5, 3}};
  RevoxeliseOptions rule = voxelRule(grid);
  rule.box = box;
  EXPECT_EQ(volumeDifference(decodeGrid(grid, {.box = box}), revoxelise(grid.field, rule)), "");
}

TEST(GridCoding, ALevelSetsMaskComesBackWithItsInside) {
  const Field field = ball();
  const SparseVolume source = revoxelise(field, {.threshold = 0.25f, .narrowBand = true});
  const SparseVolume decoded =
      decodeGrid(makeStoredGrid(kLevelSet, source, field, Activity::kExact));
  EXPECT_EQ(volumeDifference(source, decoded), "");
}

TEST(GridCoding, ABoxLeavesTheVoxelsOutsideInactive) {
  const Field field = positiveField(5);
  const SparseVolume source = revoxelise(field, {.threshold = 0.01f});
  const Box all = activeBox(source);
  const Box box{all.min, {all.max.x, (all.min.y + all.max.y) / 2, all.max.z}};
  for (const auto activity : {Activity::kByValue, Activity::kExact}) {
    const StoredGrid grid = makeStoredGrid(kFog, source, field, activity);
    const SparseVolume whole = decodeGrid(grid), part = decodeGrid(grid, {.box = box});
    EXPECT_LT(activeVoxelCount(part), activeVoxelCount(whole));
    for (Coord v = all.min; v.y <= all.max.y; ++v.y)
      EXPECT_EQ(valueAt(part, v), v.y <= box.max.y ? valueAt(whole, v) : source.background);
  }
}

TEST(GridCoding, TheRuleOfTheVoxelsIsWhatDecodingGoesBy) {
  const auto expectDecoded = [](const Field& field, Activity activity, TopologyKind kind) {
    const StoredGrid grid = makeStoredGrid(kFog, revoxelise(field, {}), perturbed(field), activity);
    EXPECT_EQ(grid.topology, kind);
    EXPECT_EQ(volumeDifference(decodeGrid(grid), revoxelise(grid.field, voxelRule(grid))), "");
  };
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    expectDecoded(positiveField(seed), Activity::kByValue, TopologyKind::kThreshold);
    expectDecoded(positiveField(seed), Activity::kExact, TopologyKind::kMask);
  }
  expectDecoded(randomField({.count = 20, .extent = 30.0}), Activity::kByValue,
                TopologyKind::kThreshold);
  const StoredGrid band = makeStoredGrid(
      kLevelSet, revoxelise(ball(), {.threshold = 0.01f, .narrowBand = true}), ball());
  EXPECT_TRUE(voxelRule(band).narrowBand);
}

TEST(GridCoding, AGivenThresholdReplacesTheStoredOne) {
  const Field field = positiveField(5);
  const StoredGrid grid = makeStoredGrid(kFog, revoxelise(field, {.threshold = 0.01f}), field);
  EXPECT_EQ(volumeDifference(decodeGrid(grid, {.threshold = 0.5f}),
                             revoxelise(field, {.threshold = 0.5f})),
            "");
}

TEST(GridCoding, ThresholdsThatMakeNoSenseAreRefused) {
  const StoredGrid grid;
  for (const float t :
       {-1.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
    EXPECT_THROW(static_cast<void>(decodeGrid(grid, {.threshold = t})), UsageError);
}

TEST(GridCoding, ASourceWithoutActiveVoxelsIsRefused) {
  EXPECT_THROW(static_cast<void>(makeStoredGrid(kFog, SparseVolume{}, Field{})), BadInput);
}

}  // namespace
}  // namespace esvr::test
