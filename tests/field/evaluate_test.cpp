// Plan: evaluateBricks (float32, SIMD, lists) agrees with evaluateReference (float64, every
// ellipsoid at every voxel) for kernels from the Gaussian limit to a hard edge, for thin and flat
// ellipsoids, far origins and supports that cross bricks. The reference is zero outside
// reachedBricks. The result does not depend on the number of threads, on the field's position, or
// on the other bricks.
// A field that is evaluated batch by batch, with limits on the pairs that are listed at once, has the
// values of one evaluation, bit for bit, and all bricks are visited in order.
// The average number of ellipsoids that reach a voxel, over the voxels that any reaches, agrees with a
// count by the definition in float64, for shared kernels and kernels of each ellipsoid.
//
// evaluatePlaces (float32, lists) agrees between voxels with a float64 sum over all ellipsoids, and at voxels with
// evaluateReference; the order and number of the places does not matter; places outside the index space are refused.
//
// The rule follows its definition in RevoxeliseOptions for all backgrounds, ranges,
// thresholds and bands, and revoxelise() applies it. The voxels of a box in a brick are compared with a
// test of every voxel, for boxes that cut through it, miss it, contain it, are empty, or end at the
// limits of 32-bit integers. The region of a brick is compared with its definition for all combinations
// of box, bricks and masks, and voxels that are always active are, also where no ellipsoid is.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/evaluate.h"
#include "field/line_form.h"
#include "field/random_field.h"
#include "field/voxel_rule.h"
#include "fit/volumes.h"
#include "support/machine.h"

namespace esvr {
namespace {

// Voxels.

using test::cornersOfCube;
using test::RandomFieldOptions;

std::vector<float> evaluate(const Field& field, const std::vector<Coord>& corners) {
  std::vector<float> values(corners.size() * kBrickVoxels);
  evaluateBricks(field, corners, values);
  return values;
}

double largestError(const Field& field, const std::vector<Coord>& corners) {
  const auto values = evaluate(field, corners);
  double worst = 0.0;
  for (std::size_t b = 0; b < corners.size(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double reference = evaluateReference(field, corners[b] + voxelLocal(v));
      worst = std::max(worst, std::abs(double(values[b * kBrickVoxels + v]) - reference));
    }
  return worst;
}

class EvaluateKappa : public testing::TestWithParam<float> {};

// A float32 ulp of m is at most 2^-23 m, and |phi'| m is limited, so the error of one term is a few
// ulp of its intensity times the steepness of the edge.
TEST_P(EvaluateKappa, AgreesWithTheFloat64Sum) {
  const Field field = test::randomField({.count = 30, .extent = 32, .kappa = GetParam()});
  const double steepness = std::max(1.0, double(GetParam()));
  EXPECT_LT(largestError(field, cornersOfCube(6, {-8, -8, -8})),
            4e-7 * steepness * test::intensitySum(field));
}
INSTANTIATE_TEST_SUITE_P(Kernels, EvaluateKappa,
                         testing::Values(-30.f, -3.f, 0.f, 2.f, 5.f, 50.f, 5000.f));

class EvaluateAspect : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(EvaluateAspect, StaysAccurateForNeedlesAndPancakes) {
  const auto [aspect, tolerance] = GetParam();
  const Field field = test::randomField(
      {.count = 30, .extent = 24, .smallest = 0.3, .aspect = aspect, .intensity = 1.0, .seed = 11});
  EXPECT_LT(largestError(field, cornersOfCube(3)), tolerance);
}
INSTANTIATE_TEST_SUITE_P(Aspects, EvaluateAspect,
                         testing::Values(std::pair{10.0, 1e-5}, std::pair{100.0, 3e-5},
                                         std::pair{1000.0, 3e-4}));

TEST(Evaluate, GivesTheBackgroundWhereNothingReaches) {
  Field field = test::randomField({.count = 3});
  field.background = 0.25f;
  EXPECT_THAT(evaluate(field, {{800, 0, 0}}), testing::Each(0.25f));
}

TEST(Evaluate, IsTheSameBitsAtTenMillionVoxels) {
  const RandomFieldOptions near{.count = 20, .extent = 16};
  RandomFieldOptions far = near;
  far.origin = {10'000'000, -10'000'000, 10'000'000};
  const auto there = cornersOfCube(2, far.origin);
  EXPECT_EQ(evaluate(test::randomField(near), cornersOfCube(2)),
            evaluate(test::randomField(far), there));
}

TEST(Evaluate, DoesNotDependOnTheNumberOfThreads) {
  const Field field = test::randomField({.count = 300, .extent = 64});
  const auto corners = cornersOfCube(8);
  test::expectSameOnAnyThreads([&] { return evaluate(field, corners); });
}

TEST(Evaluate, DoesNotDependOnTheOtherBricks) {
  const Field field = test::randomField({.count = 50, .extent = 24});
  const auto many = evaluate(field, cornersOfCube(3));
  const auto one = evaluate(field, {{0, 0, 0}});
  EXPECT_TRUE(std::equal(one.begin(), one.end(), many.begin()));
}

TEST(Evaluate, UsesEachEllipsoidsOwnKappaWhereGiven) {
  Field field = test::randomField({.count = 20, .extent = 16});
  auto& e = field.chunks[0].ellipsoids;
  for (std::size_t i = 0; i < e.size(); ++i) e.kappa.push_back(float(i) - 8.0f);
  EXPECT_LT(largestError(field, cornersOfCube(2)), 5e-6 * test::intensitySum(field));
}

TEST(Evaluate, AddsChunksOfDifferentOrigins) {
  Field field = test::randomField({.count = 10, .extent = 16});
  field.chunks.push_back(
      test::randomField({.count = 10, .extent = 16, .origin = {-5, 3, 9}, .seed = 3}).chunks[0]);
  EXPECT_LT(largestError(field, cornersOfCube(5, {-16, -16, -16})),
            1e-6 * test::intensitySum(field));
}

TEST(ReachedBricks, HoldEveryVoxelThatIsNotBackground) {
  const Field field =
      test::randomField({.count = 8, .extent = 40, .smallest = 0.4, .aspect = 30.0});
  const auto reached = reachedBricks(field);
  EXPECT_TRUE(std::is_sorted(reached.begin(), reached.end()));
  const std::set<Coord> set(reached.begin(), reached.end());
  for (const Coord corner : cornersOfCube(25, {-80, -80, -80})) {
    if (set.contains(corner)) continue;
    for (int v = 0; v < kBrickVoxels; v += 7)
      ASSERT_EQ(evaluateReference(field, corner + voxelLocal(v)), 0.0) << toString(corner);
  }
}

TEST(ReachedBricks, AreFewForAThinDiagonalNeedle) {
  Field field = test::randomField({.count = 1});
  auto& e = field.chunks[0].ellipsoids;
  e.logScale = {std::vector{std::log(40.0f)}, {std::log(0.4f)}, {std::log(0.4f)}};
  const float half = std::sqrt(0.5f);
  e.rotation = {std::vector{half}, {0.0f}, {0.0f}, {half}};  // 90 degrees about z: along y
  const double length = 2 * 40.0 * 3.0;
  EXPECT_LT(reachedBricks(field).size(), 4 * (length / kBrickSide + 2));
}

Field paperField(std::size_t count, double extent) {
  Field field = test::randomField({.count = count, .extent = extent, .kappa = 5.0f});
  field.kernel.form = KernelForm::kPaper;
  return field;
}

/// True if rounding may decide on which side of a support's end a voxel lies. m is a float32 sum of
/// six terms, with an error of about 1e-6 of the cutoff.
bool liesOnAnEnd(const Field& field, Coord voxel) {
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  const double cutoff = kernelConstants<double>(field.kernel).cutoff;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const Matrix3 L = unitFrame(e, i);
    const double d[3] = {voxel.x - double(e.center[0][i]), voxel.y - double(e.center[1][i]),
                         voxel.z - double(e.center[2][i])};
    double m = 0.0;
    for (int r = 0; r < 3; ++r)
      m += std::pow(L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2], 2);
    if (std::abs(m - cutoff) < 1e-5 * cutoff) return true;
  }
  return false;
}

/// The tolerance is that of other kernels with this kappa. Exactly at the end of the support the
/// error may be the jump, 0.006.
TEST(PaperKernel, AgreesWithTheFloat64SumOnBothSidesOfItsJump) {
  const Field field = paperField(5, 16);
  const auto corners = cornersOfCube(4, {-8, -8, -8});
  const auto values = evaluate(field, corners);
  std::size_t onAnEnd = 0;
  for (std::size_t v = 0; v < values.size(); ++v) {
    const Coord voxel = corners[v / kBrickVoxels] + voxelLocal(int(v % kBrickVoxels));
    if (liesOnAnEnd(field, voxel)) {
      ++onAnEnd;
      continue;
    }
    ASSERT_NEAR(values[v], evaluateReference(field, voxel), 4e-7 * 5.0 * test::intensitySum(field))
        << toString(voxel);
  }
  EXPECT_LE(onAnEnd, 8u) << "supports have some thousand voxels near their ends";
}

TEST(PaperKernel, EndsAtItsCutoffWithAJump) {
  Field field = paperField(1, 1);
  auto& e = field.chunks[0].ellipsoids;
  // A sphere around the origin whose support ends between the voxels at distances 4 and 5, near 4.
  const double radius = supportRadius(kernelConstants<double>(field.kernel));
  for (auto& c : e.center) c[0] = 0.0f;
  for (auto& s : e.logScale) s[0] = float(std::log(4.001 / radius));
  e.intensity[0] = 1.0f;
  const auto values = evaluate(field, {{0, 0, 0}});
  // phi falls no faster than e^-m, and m grows by 0.005 over the last 0.001 of 4 voxels.
  EXPECT_NEAR(values[voxelOffset({4, 0, 0})], paperEnd(), 0.01 * paperEnd());
  EXPECT_EQ(values[voxelOffset({5, 0, 0})], 0.0f);
}

// Batches.

class BrickBatches : public testing::TestWithParam<double> {};

TEST_P(BrickBatches, HaveTheValuesOfOneEvaluation) {
  const Field field = test::randomField({.count = 200, .extent = 120.0});
  const auto corners = reachedBricks(field);
  std::vector<float> expected(corners.size() * kBrickVoxels), values;
  evaluateBricks(field, corners, expected);
  std::vector<Coord> visited;
  forEachBatch(
      field, corners,
      [&](const BrickBatch& batch) {
        visited.insert(visited.end(), batch.corners.begin(), batch.corners.end());
        values.insert(values.end(), batch.all.begin(), batch.all.end());
      },
      GetParam());
  EXPECT_EQ(visited, corners);
  EXPECT_EQ(values, expected);
}

// With a limit of 1, there are batches of a single brick that has more pairs.
INSTANTIATE_TEST_SUITE_P(Limits, BrickBatches, testing::Values(1.0, 300.0, kMaxListedPairs));

TEST(BrickBatch, NoBricksAreNotVisited) {
  forEachBatch(test::randomField({}), {}, [](const BrickBatch&) { FAIL(); });
}

// The bricks of each thread are made unique from time to time, so that ellipsoids that reach the
// same bricks take no memory.
TEST(ReachedBricks, OfManyEqualEllipsoidsAreThoseOfOne) {
  const Field one = test::randomField({.count = 1, .smallest = 10.0, .aspect = 1.0});
  Field many = one;
  const std::size_t bricks = reachedBricks(one).size();
  for (std::size_t n = 0; n * bricks < std::size_t{5} << 20; ++n)
    many.chunks.push_back(one.chunks.front());
  EXPECT_EQ(reachedBricks(many), reachedBricks(one));
}

// Average hits.

struct Shape {
  std::array<double, 3> center;
  Matrix3 L;
  double cutoff;
};

std::vector<Shape> shapesOf(const Field& field) {
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  std::vector<Shape> shapes;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const double kappa = e.kappa.empty() ? double(field.kernel.kappa) : double(e.kappa[i]);
    shapes.push_back({{e.center[0][i], e.center[1][i], e.center[2][i]},
                      unitFrame(e, i),
                      kernelConstants<double>(field.kernel, kappa).cutoff});
  }
  return shapes;
}

bool holds(const Shape& s, Coord v) {
  const double d[3] = {v.x - s.center[0], v.y - s.center[1], v.z - s.center[2]};
  const double* row =
      s.L.data();  // tests are not optimised, and each use of an array would be a call
  double m = 0.0;
  for (int r = 0; r < 3; ++r, row += 3) {
    const double u = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
    m += u * u;
  }
  return m < s.cutoff;
}

double countedOverAll(const Field& field) {
  constexpr int kMargin = 14, kExtent = 20;  // longer than the longest support
  const auto shapes = shapesOf(field);
  double hits = 0.0, voxels = 0.0;
  for (int x = -kMargin; x < kExtent + kMargin; ++x)
    for (int y = -kMargin; y < kExtent + kMargin; ++y)
      for (int z = -kMargin; z < kExtent + kMargin; ++z) {
        const auto here = std::count_if(shapes.begin(), shapes.end(), [&](const Shape& s) {
          return holds(s, {x, y, z});
        });
        hits += double(here);
        voxels += here > 0 ? 1.0 : 0.0;
      }
  return hits / voxels;
}

// Float32 may put a voxel on the other side of a support's border: about one voxel in ten thousand.
TEST(AverageHits, AreThoseOfACountOverEveryVoxel) {
  Field field = test::randomField({.count = 30, .extent = 20, .smallest = 0.7, .aspect = 4.0});
  EXPECT_NEAR(averageHits(field), countedOverAll(field), 1e-3);
  field.kernel = {KernelForm::kPaper, 5.0f, Kernel::kDefaultEpsilon};
  EXPECT_NEAR(averageHits(field), countedOverAll(field), 1e-3);
  for (std::size_t i = 0; i < 30; ++i)
    field.chunks[0].ellipsoids.kappa.push_back(float(i) * 0.5f + 0.5f);
  EXPECT_NEAR(averageHits(field), countedOverAll(field), 1e-3);
}

TEST(AverageHits, OfNothingAreNone) { EXPECT_EQ(averageHits(Field{}), 0.0); }

// Places between voxels.

/// The definition at any place.
double valueAt(const Field& field, const Place& place) {
  double value = field.background;
  for (const Chunk& chunk : field.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i) {
      const Ellipsoids& e = chunk.ellipsoids;
      const double d[3] = {place[0] - chunk.origin.x - e.center[0][i],
                           place[1] - chunk.origin.y - e.center[1][i],
                           place[2] - chunk.origin.z - e.center[2][i]};
      const Matrix3 L = unitFrame(e, i);
      double m = 0.0;
      for (int r = 0; r < 3; ++r)
        m += std::pow(L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2], 2.0);
      value += double(e.intensity[i]) * kernelPhi(kernelConstants<double>(field.kernel), m);
    }
  return value;
}

std::vector<Place> randomPlaces(std::size_t count) {
  test::Random random(3);
  std::vector<Place> places(count);
  for (Place& place : places)
    for (double& x : place) x = random(-4.0, 36.0);
  return places;
}

std::vector<float> evaluated(const Field& field, const std::vector<Place>& places) {
  std::vector<float> values(places.size());
  evaluatePlaces(field, places, values);
  return values;
}

// The tolerance is that of evaluateBricks (field.h).
TEST(EvaluatePlaces, AgreesWithTheFloat64SumBetweenVoxels) {
  const Field field = test::randomField({.count = 60, .extent = 32});
  const auto places = randomPlaces(3000);
  const auto values = evaluated(field, places);
  for (std::size_t p = 0; p < places.size(); ++p)
    ASSERT_NEAR(double(values[p]), valueAt(field, places[p]), 4e-6 * test::intensitySum(field));
}

TEST(EvaluatePlaces, GivesEachPlaceTheSameValueInAnyCompany) {
  const Field field = test::randomField({.count = 60, .extent = 32});
  const auto places = randomPlaces(200);
  const auto together = evaluated(field, places);
  for (std::size_t p = 0; p < places.size(); ++p)
    ASSERT_EQ(together[p], evaluated(field, {places[p]}).front());
}

TEST(EvaluatePlaces, GivesTheSameValuesInManyGroups) {
  const Field field = test::randomField({.count = 60, .extent = 32});
  const auto some = randomPlaces(1000);
  const auto expected = evaluated(field, some);
  std::vector<Place> many;  // more than are sorted together
  for (int i = 0; i < 300; ++i) many.insert(many.end(), some.begin(), some.end());
  const auto values = evaluated(field, many);
  for (std::size_t p = 0; p < many.size(); ++p) ASSERT_EQ(values[p], expected[p % some.size()]);
}

TEST(EvaluatePlaces, GivesTheBackgroundFarAway) {
  Field field = test::randomField({});
  field.background = 0.75f;
  EXPECT_EQ(evaluated(field, {{1e6, -1e6, 0.0}}).front(), 0.75f);
}

TEST(EvaluatePlaces, RefusesPlacesOutsideTheIndexSpace) {
  const Field field = test::randomField({});
  for (const double x : {3e9, -3e9, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(evaluated(field, {{x, 0.0, 0.0}}), UsageError);
}

// The rule.

float byDefinition(float background, const RevoxeliseOptions& o, float sum) {
  const float value = o.range ? std::clamp(sum, o.range->min, o.range->max) : sum;
  if (o.narrowBand) {
    if (std::abs(value) < background - o.threshold) return value;
    return value < 0.0f ? -background : background;
  }
  return std::abs(value - background) > o.threshold ? value : background;
}

void expectTheRule(float background, const RevoxeliseOptions& options) {
  const VoxelRule rule = makeVoxelRule(background, options);
  for (float v = -2.0f; v <= 2.0f; v += 0.0625f)
    EXPECT_EQ(rule(v), byDefinition(background, options, v))
        << background << " " << options.threshold << " " << v;
}

TEST(VoxelRule, IsThatOfRevoxeliseOptions) {
  const std::optional<ValueRange> ranges[] = {std::nullopt, ValueRange{-0.5f, 0.75f}};
  for (const float threshold : {-1.0f, 0.0f, 0.125f})
    for (const auto& range : ranges) {
      for (const float background : {0.0f, 0.25f, -1.0f})
        expectTheRule(background, {.threshold = threshold, .range = range});
      expectTheRule(0.5f, {.threshold = threshold, .range = range, .narrowBand = true});
    }
}

TEST(VoxelRule, KeepsTheSignOfWhatIsNotInTheBand) {
  const VoxelRule rule = makeVoxelRule(3.0f, {.narrowBand = true});
  EXPECT_EQ(rule(-4.0f), -3.0f);
  EXPECT_EQ(rule(4.0f), 3.0f);
  EXPECT_EQ(rule(-2.0f), -2.0f);
}

// Regions.

BrickMask maskByVoxels(const Box& box, Coord corner) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v)
    if (box.contains(corner + voxelLocal(v))) mask.set(v);
  return mask;
}

TEST(ActiveRegion, HasTheVoxelsOfABox) {
  constexpr int kFarthest = Box::kMax - (kBrickSide - 1);
  for (const Coord corner : {Coord{0, 0, 0}, Coord{-8, 16, 800}, Coord{kFarthest, Box::kMin, 0}})
    for (const Box& box :
         {Box{}, Box::whole(), Box{corner, corner}, Box{{-5, 17, 0}, {3, 20, 803}},
          Box{{1, 2, 3}, {1, 2, 3}}, Box{{3, 3, 3}, {100, 100, 2}},
          Box{{-100, -100, -100}, {-1, 100, 900}},
          Box{{kFarthest + 3, Box::kMin, 5}, {Box::kMax, Box::kMin + 2, Box::kMax}}})
      EXPECT_EQ(maskOf(box, corner), maskByVoxels(box, corner));
}

TEST(LocalBox, ContainsTheVoxelsOfTheCellsOfABrick) {
  const Box box{{-3, 4, 9}, {8, 8, 12}};
  const LocalBox local = localBox(box, {0, 0, 8}, kBrickSide);
  for (int x = 0; x <= kBrickSide; ++x)
    for (int y = 0; y <= kBrickSide; ++y)
      for (int z = 0; z <= kBrickSide; ++z)
        EXPECT_EQ(local.contains(x, y, z), box.contains({x, y, z + 8}));
}

TEST(ActiveRegion, IsThatOfTheBoxTheBricksAndTheMasks) {
  const Box box{{4, 0, 0}, {11, 7, 7}};
  const std::vector<Coord> bricks{{0, 0, 0}, {8, 0, 0}};
  std::vector<BrickMask> masks(2);
  masks[0].setAll(), masks[1].set(5);
  const Coord elsewhere{0, 8, 0};

  const RevoxeliseOptions inBox{.box = box};
  EXPECT_EQ(regionIn(inBox, bricks[0]).within, maskByVoxels(box, bricks[0]));
  EXPECT_EQ(regionIn(inBox, bricks[0]).certain.count(), 0);

  const RevoxeliseOptions inBricks{.bricks = bricks, .restrictToBricks = true};
  EXPECT_EQ(regionIn(inBricks, bricks[0]).within.count(), kBrickVoxels);
  EXPECT_EQ(regionIn(inBricks, bricks[0]).certain.count(), 0);
  EXPECT_EQ(regionIn(inBricks, elsewhere).within.count(), 0);

  const RevoxeliseOptions masked{
      .bricks = bricks, .restrictToBricks = true, .masks = masks, .box = box};
  EXPECT_EQ(regionIn(masked, bricks[0]).within, maskByVoxels(box, bricks[0]));
  EXPECT_EQ(regionIn(masked, bricks[1]).within, masks[1]);
  EXPECT_EQ(regionIn(masked, bricks[1]).certain, masks[1]);
  EXPECT_EQ(regionIn(masked, elsewhere).within.count(), 0);
}

// One voxel lies where no ellipsoid reaches, one outside the box.
TEST(ActiveRegion, SomeVoxelsAreAlwaysActive) {
  const std::vector<Coord> always{{-40, 3, 9}, {1, 0, 0}, {9, 0, 0}};
  RevoxeliseOptions options{
      .threshold = 100.0f, .box = {{-40, -40, -40}, {8, 40, 40}}, .alwaysActive = always};
  const Field field = test::randomField({.count = 20, .extent = 30.0});
  const SparseVolume volume = revoxelise(field, options);
  EXPECT_EQ(activeVoxelCount(volume), 2u);
  EXPECT_EQ(activeBox(volume), (Box{{-40, 0, 0}, {1, 3, 9}}));
  EXPECT_EQ(valueAt(volume, always[0]), field.background);
  options.threshold = -1.0f;
  options.alwaysActive = {};
  EXPECT_EQ(valueAt(volume, always[1]), valueAt(revoxelise(field, options), always[1]));
}

// A mask makes voxels active whose values are the background, and no others.
TEST(ActiveRegion, VoxelsOfAMaskAreActiveWhateverTheirValues) {
  BrickRegion region;
  region.within.set(0), region.within.set(1);
  region.certain = region.within;
  std::vector<float> values(kBrickVoxels, 1.0f);
  values[0] = 0.25f;
  const VoxelRule rule{.background = 0.25f, .threshold = 0.5f};
  EXPECT_EQ(settle(rule, region, values), region.within);
  EXPECT_EQ(values[0], 0.25f);
  EXPECT_EQ(values[1], 1.0f);
  EXPECT_EQ(values[2], 0.25f);
  region.certain = {};
  values.assign(kBrickVoxels, 1.0f);
  values[0] = 0.5f;
  const BrickMask active = settle(rule, region, values);
  EXPECT_EQ(active.count(), 1);
  EXPECT_TRUE(active.test(1));
  EXPECT_EQ(values[0], 0.25f);
}

}  // namespace

}  // namespace esvr
