// Plan: a cube of the previous frame has the voxels of its layer at their places, moved by a motion
// and by the origins, with the background where there is no brick. Values on another lattice are
// converted to units of the frame's. Frames that cannot be predicted are recognised.
//
// The weights of a sum are found from exact samples and from noisy ones. The first weights
// hold before anything was learned and where the samples do not tell. What was learned long ago
// counts less.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "codec/frame_coder.h"
#include "field/random_field.h"
#include "fit/volumes.h"

namespace esvr::codec {
namespace {

constexpr double kStep = 2.0 * 0.01 * (1.0 - 1e-6);  // of a layer with the bound 0.01

/// Values that tell every voxel of 16^3 from the others.
SparseVolume numbered() {
  return test::volumeOf({}, 2, 0.0f,
                        [](Coord v) { return float(1.0 + v.x + 0.1 * v.y + 20.0 * v.z); });
}

VoxelLayer layerOf(const SparseVolume& volume, double bound) {
  return boundedLayer(volume, bound, Activity::kByValue);
}

void expectMoved(const SparseVolume& volume, const PastVoxels& past, Coord motion,
                 double tolerance) {
  const auto cube = std::make_unique<PastCube<1>>();
  past.fill({}, motion, *cube);
  for (int v = 0; v < kBrickVoxels; ++v) {
    const double value = valueAt(volume, voxelLocal(v) - motion);
    EXPECT_NEAR(cube->place[PastCube<1>::cell(voxelLocal(v))] * kStep, value, tolerance);
    EXPECT_EQ(cube->active[PastCube<1>::cell(voxelLocal(v))], value != 0.0);
  }
}

TEST(PastVoxels, AreTheCodesOfTheSameLattice) {
  const VoxelLayer layer = layerOf(numbered(), 0.01);
  const PastVoxels past(layer, layer);
  const auto cube = std::make_unique<PastCube<1>>();
  past.fill({}, {}, *cube);
  for (int v = 0; v < kBrickVoxels; ++v)
    EXPECT_EQ(cube->place[PastCube<1>::cell(voxelLocal(v))], double(layer.codes[std::size_t(v)]));
}

TEST(PastVoxels, AreMovedAndEmptyOutsideOfBricks) {
  const SparseVolume volume = numbered();
  const VoxelLayer layer = layerOf(volume, 0.01);
  // Half a step, and the rounding of values up to 400 to float32.
  for (const Coord motion : {Coord{}, Coord{4, -4, 2}, Coord{-1, 3, -4}})
    expectMoved(volume, PastVoxels(layer, layer), motion, 0.01 + 400 * 0x1p-24);
}

TEST(PastVoxels, OfAnotherLatticeAreInUnitsOfTheFrame) {
  const SparseVolume volume = numbered();
  const VoxelLayer now = layerOf(volume, 0.01), before = layerOf(volume, 0.3);
  expectMoved(volume, PastVoxels(before, now), {1, 0, 0}, 0.3 + 400 * 0x1p-24);
}

TEST(PastVoxels, AreMappedFromValuesInOtherUnits) {
  const VoxelLayer past = layerOf(numbered(), 0.01);
  VoxelLayer now = past;
  now.divisor = 0.75;
  const PastVoxels mapped(past, now, {-2.5, 8.0});
  const SparseVolume values = volumeOf(past);
  const auto cube = std::make_unique<PastCube<1>>();
  mapped.fill({}, {}, *cube);
  for (int v = 0; v < kBrickVoxels; ++v) {
    const bool isVacant = past.vacant[0].test(v);  // vacant voxels have the background of `now`
    const double value = -2.5 * double(values.brickValues(0)[std::size_t(v)]) + 8.0;
    EXPECT_EQ(cube->place[PastCube<1>::cell(voxelLocal(v))], isVacant ? 0.0 : value * 0.75) << v;
  }
}

TEST(PastVoxels, AreLimitedWhereTheirLatticeIsTooFine) {
  const VoxelLayer past = layerOf(numbered(), 0.01);
  VoxelLayer now = past;
  now.divisor = 1e300;
  const PastVoxels fine(past, now);
  const auto cube = std::make_unique<PastCube<1>>();
  fine.fill({}, {}, *cube);
  for (const double place : cube->place) EXPECT_LE(std::abs(place), 0x1p35);
}

TEST(PastVoxels, AreFoundFromAnotherOrigin) {
  VoxelLayer before = layerOf(numbered(), 0.01), now = before;
  now.origin = {8, -16, 0};
  const PastVoxels past(before, now);
  EXPECT_EQ(past.brickAt(0), (Coord{-1, 2, 0}));
  EXPECT_EQ(past.find({-1, 2, 0}), 0u);
  EXPECT_EQ(past.find({1, 2, 0}), BrickIndex::kNone);
}

TEST(PastVoxels, CannotPredictFarOriginsAndStrangeVacantCodes) {
  const VoxelLayer layer = layerOf(numbered(), 0.01);
  EXPECT_TRUE(isPredictable(layer, layer));
  VoxelLayer far = layer;
  far.origin.y = 1 << 30;
  EXPECT_FALSE(isPredictable(layer, far));
  VoxelLayer strange = layer;
  strange.vacant[0].set(0);
  strange.codes[0] = 17;
  EXPECT_FALSE(isPredictable(strange, layer));
}

using Squares = LeastSquares<3>;

/// Learns samples of 2 a - b + 0.5 c.
void learnSamples(Squares& squares, int count, double noise) {
  test::Random random(5);
  for (int n = 0; n < count; ++n) {
    const Squares::Terms terms{random(-9.0, 9.0), random(-9.0, 9.0), random(-9.0, 9.0)};
    const double target = 2.0 * terms[0] - terms[1] + 0.5 * terms[2];
    squares.learn(terms, target + noise * random(-1.0, 1.0));
  }
  squares.solve();
}

TEST(LeastSquares, BeginsWithTheFirstWeights) {
  Squares squares({0.5, 0.25, 0.0});
  EXPECT_EQ(squares.predict({4.0, 4.0, 4.0}), 3.0);
  squares.solve();
  EXPECT_DOUBLE_EQ(squares.predict({4.0, 4.0, 4.0}), 3.0);
}

/// The first weights count as 4 squared units in each term, and the samples as 27 * 1000. The error
/// is at most 4 / 27000 of the distances from the first weights, which sum to 3.5, times 2.
TEST(LeastSquares, FindsTheWeightsOfExactSamples) {
  Squares squares({});
  learnSamples(squares, 1000, 0.0);
  EXPECT_NEAR(squares.predict({2.0, 2.0, 2.0}), 3.0, 2e-3);
}

/// The standard error of a weight is 0.58 / sqrt(27000) = 0.0035; that of the sum is 0.012.
TEST(LeastSquares, FindsTheWeightsOfNoisySamples) {
  Squares squares({});
  learnSamples(squares, 1000, 1.0);
  EXPECT_NEAR(squares.predict({2.0, 2.0, 2.0}), 3.0, 0.05);
}

TEST(LeastSquares, KeepsTheFirstWeightsOfTermsThatAreNeverThere) {
  Squares squares({0.0, 0.0, 0.75});
  for (int n = 0; n < 100; ++n) squares.learn({1.0, 1.0, 0.0}, 1.0);
  squares.solve();
  EXPECT_NEAR(squares.predict({0.0, 0.0, 4.0}), 3.0, 1e-12);
}

TEST(LeastSquares, FollowsTheLatestSamples) {
  Squares squares({});
  for (int n = 0; n < 1000; ++n) squares.learn({1.0, 0.0, 0.0}, 1.0);
  for (int n = 0; n < 500; ++n) squares.fade();  // 1000 * 0.98^500 = 0.04 samples are left
  for (int n = 0; n < 1000; ++n) squares.learn({1.0, 0.0, 0.0}, -1.0);
  squares.solve();
  EXPECT_NEAR(squares.predict({1.0, 0.0, 0.0}), -1.0, 1e-3);
}

TEST(LeastSquares, KeepsItsWeightsIfSumsOverflow) {
  Squares squares({1.0, 0.0, 0.0});
  squares.learn({1e200, 1e200, 0.0}, 1e200);
  squares.solve();
  EXPECT_EQ(squares.predict({2.0, 0.0, 0.0}), 2.0);
}

}  // namespace

}  // namespace esvr::codec
