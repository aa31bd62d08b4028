// Plan: firstLayers() and heaviest() return the right ellipsoids, and more ellipsoids come closer
// to the whole grid.

#include "esvr/encode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../field/random_field.h"
#include "esvr/grid_coding.h"

namespace esvr {
namespace {

/// A grid of n ellipsoids whose intensities span many octaves, quantised in layers.
StoredGrid layered(std::size_t n) {
  StoredGrid grid;
  grid.field = test::randomField({.count = n, .extent = 50.0, .smallest = 1.0, .seed = 4});
  Ellipsoids& e = grid.field.chunks[0].ellipsoids;
  test::Random random(6);
  for (float& intensity : e.intensity) intensity = float(std::exp(random(-5.0, 0.0)));
  const std::vector<double> curvature(n, 20.0);
  std::vector<std::size_t> order;
  grid.quantised.push_back(
      quantise(e, chooseLattice(e, curvature, {0.02, 0.02, 0.02, 0.02}), order));
  e = dequantise(grid.quantised[0]);
  grid.activeThreshold = 1e-3f;
  grid.valueMax = 100.0f;
  return grid;
}

TEST(Layers, AreThereFromSomeEllipsoidsOn) {
  EXPECT_EQ(layerCount(layered(2000)), 1u);
  const StoredGrid grid = layered(4000);
  ASSERT_GE(layerCount(grid), 3u);
  // The first layer has at least an eighth of the ellipsoids, and the last one about a half.
  EXPECT_GE(layerSizes(grid).front().ellipsoids, 500u);
  EXPECT_LE(layerSizes(grid).back().ellipsoids, 2000u);
}

TEST(FirstLayers, AreThePrefixOfTheEllipsoids) {
  const StoredGrid grid = layered(4000);
  const StoredGrid two = firstLayers(grid, 2);
  const std::size_t n = grid.quantised[0].layerEnds[1];
  ASSERT_EQ(two.field.ellipsoidCount(), n);
  const Ellipsoids &all = grid.field.chunks[0].ellipsoids, &few = two.field.chunks[0].ellipsoids;
  EXPECT_TRUE(std::equal(few.intensity.begin(), few.intensity.end(), all.intensity.begin()));
  EXPECT_EQ(layerCount(two), 2u);
  EXPECT_EQ(layerCount(firstLayers(grid, 1)), 1u);
  EXPECT_EQ(firstLayers(grid, 99).quantised, grid.quantised);
}

double weightOf(const Ellipsoids& e, std::size_t i) {
  return e.intensity[i] *
         std::exp(0.5 * (double(e.logScale[0][i]) + e.logScale[1][i] + e.logScale[2][i]));
}

TEST(Heaviest, HasTheCountAndTheLargestWeights) {
  const StoredGrid grid = layered(3000);
  const StoredGrid few = heaviest(grid, 700);
  const Ellipsoids &all = grid.field.chunks[0].ellipsoids, &kept = few.field.chunks[0].ellipsoids;
  ASSERT_EQ(kept.size(), 700u);
  EXPECT_TRUE(few.quantised.empty());
  double lightest = HUGE_VAL;
  for (std::size_t i = 0; i < kept.size(); ++i) lightest = std::min(lightest, weightOf(kept, i));
  std::size_t heavier = 0;
  for (std::size_t i = 0; i < all.size(); ++i) heavier += weightOf(all, i) > lightest ? 1 : 0;
  EXPECT_LT(heavier, 700u);
}

TEST(Heaviest, OfAllEllipsoidsIsTheGrid) {
  const StoredGrid grid = layered(300);
  EXPECT_EQ(heaviest(grid, 300).quantised, grid.quantised);
}

}  // namespace
}  // namespace esvr
