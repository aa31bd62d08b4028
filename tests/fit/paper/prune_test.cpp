// Plan: the anisotropy follows its formula for known shapes and for sizes whose squares overflow.
// Coverage and contribution agree with a count over every voxel of a box. Every score is the
// product of its terms. A pass keeps the right ellipsoids, in the order of the population.

#include "fit/paper/prune.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/paper/paper_math.h"

namespace esvr::paper {
namespace {

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

}  // namespace
}  // namespace esvr::paper
