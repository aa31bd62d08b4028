// Plan: the tests check which ellipsoids are cloned, split or left, the parameters of clones and
// parts, the state that is reset, the limit on their number, and that every run makes the same
// choices. The anisotropy follows its formula for known shapes and for sizes whose squares overflow.
// Coverage and contribution agree with a count over every voxel of a box. Every score is the product
// of its terms. A pass keeps the right ellipsoids, in the order of the population. With one view,
// which looks along x, the score of an ellipsoid agrees with rays that are sampled densely. An opaque
// ellipsoid takes the light of those behind it, whatever the order of the list. Many views see an
// ellipsoid alike in any orientation. The number of threads does not matter.
//
// The tests check the division into subvolumes (every brick is in one, and sides follow the
// paper's rule), the initial ellipsoids, and the scaling of the schedule. On every device, a run
// lowers the error, clones and splits, prunes to the wanted count, learns k, ends at its time limit
// and when it is cancelled, and has the same bits in three runs and at a distant position. Wrong
// options are refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/paper_method.h"
#include "fit/paper/paper_optimiser.h"
#include "fit/paper/population.h"
#include "fit/volumes.h"
#include "support/machine.h"

namespace esvr::paper {
namespace {

constexpr double kSplitAbove = 2.0;

PaperEllipsoid sphere(double x, double scale) {
  PaperEllipsoid p{{x, 0.0, 0.0}, {}, {1.0, 0.0, 0.0, 0.0}, 0.8, 5.0};
  p.logScale.fill(std::log(scale));
  return p;
}

PaperState stateOf(double meanGradient) {
  PaperState state;
  state.gradientSum = 4.0 * meanGradient;
  state.seen = 4;
  state.m[0] = 1.0f;
  return state;
}

/// Small and large ellipsoids, with small and large gradients.
Population fourOf() {
  return {{sphere(0, 1.0), sphere(10, 1.0), sphere(20, 3.0), sphere(30, 3.0)},
          {stateOf(0.5), stateOf(2.0), stateOf(0.5), stateOf(2.0)}};
}

DensifyRule ruleOf(std::size_t maxCount = 100) {
  return {.threshold = 1.0, .splitAbove = kSplitAbove, .maxCount = maxCount, .seed = 7};
}

TEST(Densify, ClonesTheSmallAndSplitsTheLargeOfThoseWithLargeGradients) {
  Population population = fourOf();
  const auto counts = densify(population, ruleOf());
  EXPECT_EQ(counts.cloned, 1u);
  EXPECT_EQ(counts.split, 1u);
  ASSERT_EQ(population.size(), 6u);
  ASSERT_EQ(population.states.size(), 6u);
  EXPECT_EQ(population.ellipsoids[0].center[0], 0.0);
  EXPECT_EQ(population.ellipsoids[1].center[0], 10.0);
  EXPECT_EQ(population.ellipsoids[2].center[0], 20.0);  // the large one that was split is gone
  EXPECT_EQ(population.ellipsoids[3].center[0], 10.0);  // the clone
}

TEST(Densify, AThresholdCountsWhereItIsMetExactly) {
  Population population = fourOf();
  auto rule = ruleOf();
  rule.threshold = 0.5;
  EXPECT_EQ(densify(population, rule).cloned, 2u);
}

TEST(Densify, WhatWasNeverSeenIsLeftEvenAtAThresholdOfZero) {
  Population population = fourOf();
  population.states[1] = {};
  auto rule = ruleOf();
  rule.threshold = 0.0;
  EXPECT_EQ(densify(population, rule).cloned, 1u);
}

TEST(Densify, ACloneAndItsOriginalAddUpToWhatWas) {
  Population population = fourOf();
  densify(population, ruleOf());
  EXPECT_EQ(population.ellipsoids[1].intensity + population.ellipsoids[3].intensity, 0.8);
  EXPECT_EQ(population.ellipsoids[1].logScale, population.ellipsoids[3].logScale);
}

TEST(Densify, PartsOfASplitAreSmallerAndLieWithinAFewScales) {
  Population population = fourOf();
  densify(population, ruleOf());
  for (const std::size_t i : {4u, 5u}) {
    const PaperEllipsoid& part = population.ellipsoids[i];
    EXPECT_NEAR(std::exp(part.logScale[0]), 3.0 / 1.6, 1e-12);
    EXPECT_EQ(part.intensity, 0.8);
    EXPECT_NE(part.center[0], 30.0);
    EXPECT_LT(std::hypot(part.center[0] - 30.0, part.center[1], part.center[2]), 6.0 * 3.0);
  }
  EXPECT_NE(population.ellipsoids[4].center, population.ellipsoids[5].center);
}

// Over n draws, the errors of the mean and of the deviation of a normal distribution are s /
// sqrt(n) and s / sqrt(2 n).
TEST(Densify, PartsAreDrawnWithTheScalesOfTheWhole) {
  constexpr std::size_t kCount = 4000;
  Population population;
  PaperEllipsoid needle = sphere(0.0, 3.0);
  needle.logScale = {std::log(8.0), std::log(3.0), std::log(1.0)};
  const double half = std::sqrt(0.5);
  needle.rotation = {half, 0.0, 0.0, half};  // 90 degrees about z: the long axis along y
  population.ellipsoids.assign(kCount, needle);
  population.states.assign(kCount, stateOf(2.0));
  densify(population, {.threshold = 1.0, .splitAbove = 2.0, .maxCount = 3 * kCount, .seed = 3});
  ASSERT_EQ(population.size(), 2 * kCount);
  const double expected[3] = {3.0, 8.0, 1.0};
  for (std::size_t a = 0; a < 3; ++a) {
    double sum = 0.0, squares = 0.0;
    for (const auto& p : population.ellipsoids) {
      sum += p.center[a];
      squares += p.center[a] * p.center[a];
    }
    const double n = double(population.size());
    EXPECT_NEAR(sum / n, 0.0, 4.0 * expected[a] / std::sqrt(n));
    EXPECT_NEAR(std::sqrt(squares / n), expected[a], 4.0 * expected[a] / std::sqrt(2.0 * n));
  }
}

TEST(Densify, NewOnesBeginWithoutMomentumAndAllWithoutGradients) {
  Population population = fourOf();
  densify(population, ruleOf());
  for (std::size_t i = 0; i < population.size(); ++i) {
    EXPECT_EQ(population.states[i].seen, 0u);
    EXPECT_EQ(population.states[i].gradientSum, 0.0);
    EXPECT_EQ(population.states[i].m[0], i < 3 ? 1.0f : 0.0f);
  }
}

TEST(Densify, WhereThereIsRoomForFewTheLargestGradientsGoFirst) {
  Population population = fourOf();
  population.states[3] = stateOf(5.0);
  const auto counts = densify(population, ruleOf(5));
  EXPECT_EQ(counts.cloned, 0u);
  EXPECT_EQ(counts.split, 1u);
  EXPECT_EQ(population.size(), 5u);
  EXPECT_EQ(densify(population, ruleOf(5)).cloned, 0u);
}

TEST(Densify, ChoosesTheSameInEveryRun) {
  Population a = fourOf(), b = fourOf();
  densify(a, ruleOf());
  densify(b, ruleOf());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_EQ(a.ellipsoids[i].center, b.ellipsoids[i].center);
}

const Box kBox{{0, 0, 0}, {23, 23, 23}};
constexpr double kFloor = 1.0 / 255;

PaperEllipsoid ellipsoid(double a, double b, double c, double intensity = 0.5) {
  return {{11.2, 12.7, 10.4},
          {std::log(a), std::log(b), std::log(c)},
          {0.8, 0.1, -0.5, 0.3},
          intensity,
          5.0};
}

TEST(FractionalAnisotropy, IsThatOfTheFormula) {
  EXPECT_EQ(fractionalAnisotropy({0.3, 0.3, 0.3}), 0.0);
  // The eigenvalues are 4, 1, 1, which gives sqrt(1/2) sqrt(9 + 0 + 9) / sqrt(18).
  EXPECT_NEAR(fractionalAnisotropy({std::log(2.0), 0.0, 0.0}), std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(fractionalAnisotropy({std::log(1e3), 0.0, 0.0}), 1.0, 1e-5);
  // A disc has the eigenvalues 1, 1, 0.
  EXPECT_NEAR(fractionalAnisotropy({0.0, 0.0, -30.0}), std::sqrt(0.5), 1e-15);
}

TEST(FractionalAnisotropy, IsTheSameForEverySizeAndOrder) {
  const double value = fractionalAnisotropy({1.0, 0.2, -0.4});
  EXPECT_NEAR(fractionalAnisotropy({0.2, -0.4, 1.0}), value, 1e-15);
  for (const double size : {-150.0, 150.0})  // squares of the eigenvalues e^600 would overflow
    EXPECT_NEAR(fractionalAnisotropy({1.0 + size, 0.2 + size, -0.4 + size}), value, 1e-12);
}

Coverage countedOverAll(const PaperEllipsoid& p, const KernelKind& kind) {
  const Ellipsoid unit = ellipsoidOf(p, kind);
  const auto kernel = kernelConstants<double>(kernelOf(kind));
  Coverage counted;
  for (int x = kBox.min.x; x <= kBox.max.x; ++x)
    for (int y = kBox.min.y; y <= kBox.max.y; ++y)
      for (int z = kBox.min.z; z <= kBox.max.z; ++z) {
        double m = 0.0;
        for (int r = 0; r < 3; ++r)
          m += std::pow(unit.L[3 * r] * (x - p.center[0]) + unit.L[3 * r + 1] * (y - p.center[1]) +
                            unit.L[3 * r + 2] * (z - p.center[2]),
                        2);
        const double value = std::abs(p.intensity) * kernelPhi(kernel, m);
        if (value < kFloor || value == 0.0) continue;
        counted.voxels += 1.0;
        counted.contribution += value;
      }
  return counted;
}

TEST(Coverage, CountsTheVoxelsAboveTheFloor) {
  for (const KernelKind kind : {KernelKind{}, KernelKind{.gaussian = true}})
    for (const PaperEllipsoid& p :
         {ellipsoid(3, 2, 1), ellipsoid(12, 1, 1), ellipsoid(0.3, 0.3, 0.3),
          ellipsoid(4, 4, 1, -0.4), ellipsoid(2, 2, 2, 0.001)}) {
      const Coverage found = coverageOf(p, {kind, kBox, kFloor}), counted = countedOverAll(p, kind);
      EXPECT_EQ(found.voxels, counted.voxels);
      EXPECT_NEAR(found.contribution, counted.contribution, 1e-12 * counted.contribution);
    }
}

TEST(Coverage, IsNothingBeyondTheBox) {
  PaperEllipsoid outside = ellipsoid(2, 2, 2);
  outside.center = {-20.0, 0.0, 0.0};
  EXPECT_EQ(coverageOf(outside, {{}, kBox, kFloor}).voxels, 0.0);
}

TEST(PruneScores, AreProductsOfTheirTerms) {
  const std::vector<PaperEllipsoid> all = {ellipsoid(3, 2, 1), ellipsoid(2, 2, 2, 0.9),
                                           ellipsoid(6, 1, 1, -0.2)};
  const CoverageOptions options{{}, kBox, kFloor};
  const auto full = pruneScores(all, PruneScore::kFull, options),
             withoutFa = pruneScores(all, PruneScore::kWithoutFa, options),
             onlyFa = pruneScores(all, PruneScore::kOnlyFa, options),
             contribution = pruneScores(all, PruneScore::kContribution, options);
  // LightGaussian's factor: the 90th percentile of three volumes is at the place of the middle one.
  const double volumes[3] = {6.0, 8.0, 6.0};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Coverage coverage = coverageOf(all[i], options);
    const double fa = fractionalAnisotropy(all[i].logScale);
    EXPECT_EQ(onlyFa[i], fa);
    EXPECT_EQ(withoutFa[i], coverage.voxels * std::abs(all[i].intensity));
    EXPECT_EQ(full[i], withoutFa[i] * fa);
    EXPECT_NEAR(contribution[i],
                coverage.contribution * std::pow(std::min(volumes[i] / 6.0, 1.0), 0.1),
                1e-12 * contribution[i]);
  }
}

TEST(KeepHighest, KeepsOrderAndTheEarlierOfEqualOnes) {
  Population population;
  for (int i = 0; i < 6; ++i) {
    population.ellipsoids.push_back(ellipsoid(1, 1, 1, i));
    population.states.push_back({});
    population.states.back().seen = std::uint32_t(i);
  }
  const std::vector<double> scores = {1.0, 5.0, 2.0, 5.0, 2.0, 0.0};
  keepHighest(population, scores, 3);
  ASSERT_EQ(population.size(), 3u);
  const double kept[3] = {1, 2, 3};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(population.ellipsoids[i].intensity, kept[i]);
    EXPECT_EQ(population.states[i].seen, std::uint32_t(kept[i]));
  }
  keepHighest(population, std::vector<double>(3, 1.0), 10);
  EXPECT_EQ(population.size(), 3u);
}

constexpr double kRayFloor = 1.0 / 255;
const CoverageOptions kRayOptions{{}, {{0, 0, 0}, {22, 22, 22}}, kRayFloor};
constexpr int kRayMiddle = 11,
              kRayReach = 20;  // the corners of the box are 19.1 voxels from its middle

PaperEllipsoid seenEllipsoid(std::array<double, 3> center, std::array<double, 3> scale,
                             double intensity) {
  return {center,
          {std::log(scale[0]), std::log(scale[1]), std::log(scale[2])},
          {0.8, 0.1, -0.5, 0.3},
          intensity,
          5.0};
}

/// The largest |I| phi on the ray along x through a voxel of the plane x = 0.
double largestAlong(const PaperEllipsoid& p, const KernelKind& kind, double y, double z) {
  constexpr double kStep = 0.01;
  const Ellipsoid unit = ellipsoidOf(p, kind);
  const auto kernel = kernelConstants<double>(kernelOf(kind));
  double largest = 0.0;
  for (double x = p.center[0] - kRayReach; x < p.center[0] + kRayReach; x += kStep) {
    const double d[3] = {x - p.center[0], y - p.center[1], z - p.center[2]};
    const double* row =
        unit.L.data();  // tests are not optimised, and each use of an array would be a call
    double m = 0.0;
    for (int r = 0; r < 3; ++r, row += 3) {
      const double u = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
      m += u * u;
    }
    largest = std::max(largest, kernelPhi(kernel, m));
  }
  return std::abs(p.intensity) * largest;
}

double sampledScore(const PaperEllipsoid& p, const KernelKind& kind) {
  double sum = 0.0;
  for (int y = kRayMiddle - kRayReach; y <= kRayMiddle + kRayReach; ++y)
    for (int z = kRayMiddle - kRayReach; z <= kRayMiddle + kRayReach; ++z) {
      const double opacity = std::min(largestAlong(p, kind, y, z), 0.99);
      if (opacity >= kRayFloor) sum += opacity;
    }
  return sum;
}

TEST(RayScores, SlowAgreeWithDenselySampledRays) {
  for (const KernelKind kind : {KernelKind{}, KernelKind{.gaussian = true}})
    for (const auto& p : {seenEllipsoid({10.2, 11.7, 9.4}, {3, 2, 1}, 0.5),
                          seenEllipsoid({11, 11, 11}, {5, 0.7, 1}, -2.0)}) {
      CoverageOptions options = kRayOptions;
      options.kind = kind;
      const auto scores = rayContributions(std::vector{p}, options, 1);
      // Steps of 0.01 voxels miss the maximum by at most |d2 phi| (0.005)^2 / 2, about 1e-4.
      EXPECT_NEAR(scores[0], sampledScore(p, kind), 1e-3 * scores[0]);
    }
}

TEST(RayScores, AreThoseOfTheLightThatIsLeft) {
  const auto behind = seenEllipsoid({16, 11, 11}, {1, 1, 1}, 0.5);
  const auto opaque = seenEllipsoid({5, 11, 11}, {4, 4, 4}, 1e4);
  const auto beside = seenEllipsoid({5, 2, 2}, {0.5, 0.5, 0.5}, 0.5);
  const double alone = rayContributions(std::vector{behind}, kRayOptions, 1)[0];
  const auto scores = rayContributions(std::vector{behind, opaque, beside}, kRayOptions, 1);
  EXPECT_NEAR(scores[0], 0.01 * alone, 1e-6 * alone) << "the opacity is at most 0.99";
  EXPECT_NEAR(rayContributions(std::vector{behind, beside}, kRayOptions, 1)[0], alone,
              1e-6 * alone);
}

TEST(RayScores, DoNotDependOnTheOrientation) {
  auto needle = seenEllipsoid({11, 11, 11}, {8, 3, 3}, 0.5);
  const double first = rayContributions(std::vector{needle}, kRayOptions)[0];
  for (const std::array<double, 4> turn : {std::array{1.0, 0.0, 0.0, 0.0}, {0.5, 0.5, 0.5, 0.5}}) {
    needle.rotation = turn;
    // 360 directions are 11 degrees apart, and the rays are samples of the edge.
    EXPECT_NEAR(rayContributions(std::vector{needle}, kRayOptions)[0], first, 0.02 * first);
  }
}

TEST(RayScores, DoNotDependOnTheNumberOfThreads) {
  std::vector<PaperEllipsoid> several;
  for (int i = 0; i < 40; ++i)
    several.push_back(seenEllipsoid({double(i % 23), double(7 * i % 23), double(13 * i % 23)},
                                    {1.0 + i % 3, 1.0, 2.0}, 0.3));
  test::expectSameOnAnyThreads([&] { return rayContributions(several, kRayOptions); });
}

TEST(RayScores, AreZeroBesideThePictures) {
  const auto far = seenEllipsoid({1e6, -1e6, 11}, {1, 1, 1}, 0.5);
  EXPECT_EQ(rayContributions(std::vector{far}, kRayOptions)[0], 0.0);
  EXPECT_TRUE(rayContributions({}, kRayOptions).empty());
}

// ---- The run

TEST(Subvolumes, HoldEveryBrickOnceAndKeepToTheirBoxes) {
  const SparseVolume volume = test::tubeVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  std::size_t bricks = 0, cubes = 0;
  std::set<Coord> seen;
  for (const auto& part : cutSubvolumes(target, spaceOf(target), 16)) {
    ++cubes;
    bricks += part->target.bricks.size();
    EXPECT_EQ(part->target.values.size(), part->target.bricks.size() * kBrickVoxels);
    EXPECT_EQ(part->active.size(), part->target.bricks.size());
    for (const Coord brick : part->target.bricks) {
      EXPECT_TRUE(part->target.within->contains(brick));
      seen.insert(brick);
    }
  }
  EXPECT_EQ(bricks, target.bricks.size());
  EXPECT_EQ(seen.size(), target.bricks.size());
  const Coord sides = spaceOf(target).bricks.max - spaceOf(target).bricks.min;
  EXPECT_EQ(cubes, std::size_t((sides.x / 2 + 1) * (sides.y / 2 + 1) * (sides.z / 2 + 1)));
}

TEST(Subvolumes, AreHalfTheLongestAxisOrTheShortest) {
  const auto sideOf = [](int x, int y, int z, int asked) {
    const Space space{{{0, 0, 0}, {x / 8 - 1, y / 8 - 1, z / 8 - 1}}};
    return subvolumeSide(space, asked);
  };
  EXPECT_EQ(sideOf(256, 256, 256, 0), 128);    // the paper's side for Aneurysm
  EXPECT_EQ(sideOf(2544, 1296, 136, 0), 136);  // Neuron: the shortest axis, in whole bricks
  EXPECT_EQ(sideOf(88, 88, 88, 0), 48);        // 44, in whole bricks
  EXPECT_EQ(sideOf(256, 256, 256, 60), 64);
  EXPECT_EQ(sideOf(8, 8, 8, 0), 8);
}

TEST(InitialPoints, LieOnVoxelsThatDifferFromTheBackgroundEachOnce) {
  const SparseVolume volume = test::tubeVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  for (const std::size_t points : {std::size_t{50}, std::size_t{100'000}}) {
    const auto drawn = initialPoints(target, points, {}, 5);
    const auto voxels = std::size_t(std::count_if(target.values.begin(), target.values.end(),
                                                  [](float v) { return v != 0.0f; }));
    EXPECT_EQ(drawn.size(), std::min(points, voxels));
    std::set<std::array<double, 3>> places;
    for (const auto& p : drawn) {
      const Coord at{int(p.center[0]), int(p.center[1]), int(p.center[2])};
      EXPECT_NE(valueAt(volume, volume.origin + at), 0.0f);
      places.insert(p.center);
    }
    EXPECT_EQ(places.size(), drawn.size());
  }
}

TEST(InitialPoints, OfEveryVoxelAddUpToTheVolume) {
  const SparseVolume volume = test::volumeOf({}, 2, 0.0f, [](Coord) { return 1.0f; });
  const FitTarget target = makeTarget(volume, std::nullopt);
  // In the middle of the cube, the sum over the lattice of a kernel that reaches three times its
  // spacing equals its integral to a few percent.
  const Coord middle{8, 8, 8};
  for (const KernelKind kind : {KernelKind{}, KernelKind{.gaussian = true}}) {
    const auto kernel = kernelConstants<double>(kernelOf(kind));
    double sum = 0.0;
    for (const auto& p : initialPoints(target, 1 << 20, kind, 1)) {
      double q = 0.0;
      const double at[3] = {double(middle.x), double(middle.y), double(middle.z)};
      for (std::size_t a = 0; a < 3; ++a) q += (at[a] - p.center[a]) * (at[a] - p.center[a]);
      const double units = kind.unitsPerScale(kind.k) / std::exp(p.logScale[0]);
      sum += p.intensity * kernelPhi(kernel, q * units * units);
    }
    EXPECT_NEAR(sum, target.values[0], 0.1 * double(target.values[0]));
  }
}

TEST(InitialPoints, OfBothKernelsReachThreeTimesTheirDistance) {
  const SparseVolume volume = test::volumeOf({}, 2, 0.0f, [](Coord) { return 1.0f; });
  const FitTarget target = makeTarget(volume, std::nullopt);
  const std::size_t points = target.values.size() / 8;  // a distance of 2 voxels
  for (const KernelKind kind : {KernelKind{}, KernelKind{.gaussian = true}}) {
    const double ending = supportRadius(kernelConstants<double>(kernelOf(kind)));
    const auto p = initialPoints(target, points, kind, 1).front();
    EXPECT_NEAR(std::exp(p.logScale[0]) * ending / kind.unitsPerScale(kind.k), 6.0, 1e-9);
  }
}

TEST(PaperMethod, IsScaledInAllThatIsSaidInEpochs) {
  const PaperMethod method = scaledTo({}, 280);
  EXPECT_EQ(method.densifyUntil, 40u);
  EXPECT_EQ(method.densifyFrom, 2u);   // rounded from 1.6
  EXPECT_EQ(method.densifyEvery, 1u);  // rounded from 0.4, at least 1
  EXPECT_EQ(method.prunes.front().epoch, 120u);
  EXPECT_EQ(withThreePasses({}).prunes.size(), 3u);
}

class PaperRunOn : public test::OnDevice {
 protected:
  [[nodiscard]] static PaperMethod shortMethod() {
    PaperMethod method;
    method.points = 300;
    method.epochs = 60;
    method.densifyFrom = 4;
    method.densifyUntil = 16;
    method.gradientThreshold = 0.02;  // the mean over few voxels of a small volume
    method.percentDense = 0.06;       // 1.2 voxels
    method.prunes = {{24, 0.3}};
    return method;
  }
  [[nodiscard]] PaperFitResult run(const PaperMethod& method, Coord shift = {},
                                   PaperFitOptions options = {}) const {
    options.method = method;
    options.device = device_;
    return fitByPaper(test::tubeVolume(shift), options);
  }
};

TEST_P(PaperRunOn, LowersTheErrorAndSaysWhatItDid) {
  const auto [result, record] = run(shortMethod());
  EXPECT_EQ(result.end, FitEnd::kScheduleDone);
  EXPECT_EQ(record.points, 300u);
  EXPECT_EQ(record.iterations, 60u * record.subvolumes);
  EXPECT_GT(record.cloned + record.split, 0u);
  EXPECT_GT(record.firstGradient, 0.0);
  ASSERT_EQ(record.prunes.size(), 1u);
  const PruneRecord& pass = record.prunes.front();
  EXPECT_EQ(pass.before, 300 + record.cloned + record.split);
  EXPECT_NEAR(double(pass.after), 0.7 * double(pass.before), 0.5);
  EXPECT_NE(pass.psnrBoxAfter, pass.psnrBoxBefore);
  EXPECT_GT(result.curve.back().psnrBox, pass.psnrBoxAfter + 1.0);
  EXPECT_LE(result.field.ellipsoidCount(), pass.after);
  EXPECT_EQ(result.field.kernel.form, KernelForm::kPaper);
}

TEST_P(PaperRunOn, SlowLeavesTheCountThatIsAsked) {
  PaperFitOptions options;
  options.count = 120;
  EXPECT_EQ(run(shortMethod(), {}, options).record.prunes.back().after, 120u);
}

TEST_P(PaperRunOn, SlowWithoutPruningAddsUpToTheCount) {
  PaperFitOptions options;
  options.count = 400;
  PaperMethod method = shortMethod();
  method.prunes.clear();
  method.gradientThreshold = 0.0;
  EXPECT_EQ(run(method, {}, options).fit.curve.end()[-2].ellipsoids, 400u);
}

TEST_P(PaperRunOn, SlowWithoutDensifyingOnlyMovesThePoints) {
  PaperMethod method = shortMethod();
  method.densify = false;
  method.prunes.clear();
  const FitResult result = run(method).fit;
  EXPECT_EQ(result.curve.end()[-2].ellipsoids, 300u);
  EXPECT_GT(result.curve.back().psnrBox, result.curve.front().psnrBox);
}

TEST_P(PaperRunOn, SlowLearnsKOfEachEllipsoid) {
  PaperMethod method = shortMethod();
  method.learnK = true;
  const FitResult result = run(method).fit;
  std::set<float> values;
  for (const Chunk& chunk : result.field.chunks) {
    ASSERT_EQ(chunk.ellipsoids.kappa.size(), chunk.ellipsoids.size());
    values.insert(chunk.ellipsoids.kappa.begin(), chunk.ellipsoids.kappa.end());
  }
  EXPECT_GT(values.size(), 10u);
}

TEST_P(PaperRunOn, SlowFitsGaussiansWithTheSameMethod) {
  PaperMethod method = shortMethod();
  method.gaussian = true;
  const auto [gaussians, gaussianRecord] = run(method);
  method.gaussian = false;
  const auto [ellipsoids, ellipsoidRecord] = run(method);
  EXPECT_GT(gaussians.curve.back().psnrBox, gaussianRecord.prunes.front().psnrBoxAfter);
  EXPECT_LT(gaussians.field.kernel.kappa, -20.0f);
  // Gaussians have supports of 3 sigma, and ellipsoids of 1.42 scales, so more Gaussians reach a
  // voxel.
  EXPECT_GT(gaussianRecord.hits, 1.3 * ellipsoidRecord.hits);
  EXPECT_NEAR(ellipsoidRecord.hits, averageHits(ellipsoids.field), 1e-9);
  EXPECT_GT(ellipsoidRecord.prunes.front().hitsBefore, 1.0);
}

TEST_P(PaperRunOn, GivesTheSameBitsInThreeRunsAndInAFarPlace) {
  PaperMethod method = shortMethod();
  method.epochs = 20;
  method.prunes = {{18, 0.3}};
  const Field first = run(method).fit.field;
  for (int n = 0; n < 2; ++n) EXPECT_TRUE(test::sameBits(run(method).fit.field, first));
  EXPECT_TRUE(test::sameBits(run(method, {1 << 20, -(1 << 20), 1 << 20}).fit.field, first));
}

TEST_P(PaperRunOn, EndsWhenItsPsnrIsReachedOrItIsCancelled) {
  PaperFitOptions options;
  options.psnr = 5.0;
  EXPECT_EQ(run(shortMethod(), {}, options).fit.end, FitEnd::kPsnrReached);
  CancelToken cancel;
  cancel.cancel();
  options.psnr = std::nullopt;
  options.cancel = &cancel;
  EXPECT_THROW(run(shortMethod(), {}, options), Cancelled) << "there is no result yet";
}

ESVR_ON_DEVICES(PaperRunOn);

TEST(PaperFitOptionsOfAFit, AreRefusedWhereTheyMakeNoSense) {
  const auto refused = [](const std::function<void(PaperFitOptions&)>& change) {
    PaperFitOptions options;
    change(options);
    EXPECT_THROW((void)fitByPaper(test::tubeVolume(), options), UsageError);
  };
  refused([](PaperFitOptions& o) { o.count = 0; });
  refused([](PaperFitOptions& o) { o.seconds = 0.0; });
  refused([](PaperFitOptions& o) { o.method.beta = 2.0; });
  refused([](PaperFitOptions& o) { o.method.k = 0.0; });
  refused([](PaperFitOptions& o) { o.method.points = 0; });
  refused([](PaperFitOptions& o) { o.method.densifyEvery = 0; });
  refused([](PaperFitOptions& o) { o.method.prunes = {{10, 1.0}}; });
  refused([](PaperFitOptions& o) { o.method.prunes = {{10, 0.5}, {10, 0.5}}; });
}

TEST(FitByPaper, OfAVolumeThatIsAllBackgroundIsEmpty) {
  const SparseVolume volume = test::fullBricks({Coord{}}, 0.5f, [](Coord) { return 0.5f; });
  EXPECT_EQ(fitByPaper(volume, {}).fit.field.ellipsoidCount(), 0u);
}

}  // namespace

}  // namespace esvr::paper
