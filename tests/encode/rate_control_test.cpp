// Plan: the errors of trials and of their layers agree with those of the decoded voxels, and several
// trials at once give the same results as single ones. A compact grid keeps to its loss, its PSNR or its
// bytes.

#include "encode/rate_control.h"

#include <gtest/gtest.h>

#include <tbb/global_control.h>
#include <cmath>

#include "../fit/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

using encode::compactGrid;
using encode::CompactOptions;
using encode::CompactResult;

StoredGrid storedOf(StoredGrid grid, const encode::RateTrial& trial) {
  grid.field = trial.field;
  grid.quantised = trial.quantised;
  return grid;
}

VolumeMetrics metricsOf(const SparseVolume& source, const StoredGrid& grid) {
  return compareVolumes(source, decodeGrid(grid), {.box = {}, .peak = {}, .ssim = false});
}

struct Fitted {
  SparseVolume source = test::tubeVolume();
  StoredGrid grid;

  Fitted() {
    FitOptions options;
    options.count = 100;
    options.iterations = 150;
    options.kappa = 2.0f;
    grid = makeStoredGrid({}, source, fit(source, options).field, Activity::kByValue);
  }
};

TEST(Trial, HasTheErrorOfItsVoxels) {
  const Fitted fitted;
  encode::RateTrials maker(fitted.grid, fitted.source, {});
  const encode::RateTrial trial = maker.make({0.1, 0.1, 0.1, 0.1});
  const auto metrics = metricsOf(fitted.source, storedOf(fitted.grid, trial));
  const double squares = metrics.mseBox * metrics.boxVoxels;
  EXPECT_NEAR(trial.error, squares, 1e-6 * squares);  // float32 sums depend on the order
}

TEST(Trial, AmongSeveralIsTheSameAsAlone) {
  const Fitted fitted;
  encode::RateTrials maker(fitted.grid, fitted.source, {});
  const QuantiserSteps steps[] = {{0.1, 0.1, 0.1, 0.1}, {0.05, 0.1, 0.2, 0.1}};
  const auto both = maker.make(steps);
  for (std::size_t k = 0; k < both.size(); ++k) {
    const encode::RateTrial alone = maker.make(steps[k]);
    EXPECT_EQ(both[k].quantised, alone.quantised);
    EXPECT_EQ(both[k].error, alone.error);
    EXPECT_EQ(both[k].bytes, alone.bytes);
  }
}

TEST(Trial, KnowsTheErrorsOfItsLayers) {
  const SparseVolume source = test::ellipsoidVolume(300, 0.2, 1.0);
  Field field = test::randomField({.count = 2500, .extent = 30.0, .smallest = 0.7, .seed = 5});
  test::Random random(6);
  for (float& i : field.chunks[0].ellipsoids.intensity) i = float(std::exp(random(-6.0, -1.0)));
  const StoredGrid grid = makeStoredGrid({}, source, field, Activity::kByValue);
  encode::RateTrials maker(grid, source, {});
  const encode::RateTrial trial = maker.make({0.1, 0.1, 0.1, 0.1});
  const StoredGrid stored = storedOf(grid, trial);
  const auto errors = maker.layerErrors(trial);
  ASSERT_GE(errors.size(), 2u);
  ASSERT_EQ(errors.size(), layerCount(stored));
  for (std::size_t k = 1; k <= errors.size(); ++k) {
    const auto metrics = metricsOf(source, firstLayers(stored, k));
    EXPECT_NEAR(errors[k - 1].psnrBox, metrics.psnrBox, 1e-4) << k;
    EXPECT_NEAR(errors[k - 1].maxError, metrics.maxError, 1e-5) << k;
  }
}

struct Example {
  SparseVolume source;
  StoredGrid grid;
};

Example fitted(const SparseVolume& volume, bool narrowBand = false) {
  FitOptions options;
  options.count = 60;
  options.iterations = 150;
  options.kappa = 2.0f;
  options.narrowBand = narrowBand;
  GridDescriptor descriptor;
  if (narrowBand) descriptor.gridClass = GridClass::kLevelSet;
  return {volume, makeStoredGrid(descriptor, volume, fit(volume, options).field)};
}
const Example& tube() {
  static const Example example = fitted(test::tubeVolume());
  return example;
}

std::vector<std::byte> bytesOf(const StoredGrid& grid) { return encodeEsvr({{}, {grid}}); }

VolumeMetrics metricsOf(const Example& example, const StoredGrid& grid) {
  const auto back = decodeEsvr(bytesOf(grid), "memory").grids[0];
  return compareVolumes(example.source, decodeGrid(back));
}
double psnrOf(const Example& example, const StoredGrid& grid) {
  return metricsOf(example, grid).psnrBox;
}
double iouOf(const Example& example, const StoredGrid& grid) {
  return metricsOf(example, grid).iou;
}

TEST(CompactGrid, CostsNoMoreThanWasAllowed) {
  const double before = psnrOf(tube(), tube().grid);
  for (const double loss : {0.05, 0.3, 2.0}) {
    const auto compact = compactGrid(tube().grid, tube().source, {.loss = loss});
    const double after = psnrOf(tube(), compact.grid);
    // The search and the metric both sum in float64; voxels are float32.
    EXPECT_GE(after, before - loss - 1e-4) << loss;
    EXPECT_NEAR(compact.loss, before - after, 1e-3);
  }
}

TEST(CompactGrid, SpendsFewerBytesWhereMoreLossIsAllowed) {
  const auto size = [](double loss) {
    return bytesOf(compactGrid(tube().grid, tube().source, {.loss = loss}).grid).size();
  };
  // With 60 ellipsoids the bytes change in jumps of a twentieth.
  const std::size_t fine = size(0.05), usual = size(1.0), coarse = size(3.0);
  EXPECT_LT(usual, fine);
  EXPECT_LT(coarse, usual);
  EXPECT_LT(2 * usual, bytesOf(tube().grid).size());
}

TEST(CompactGrid, SpendsWhatThePsnrLeaves) {
  const double before = psnrOf(tube(), tube().grid);
  const auto compact = compactGrid(tube().grid, tube().source, {.psnr = before - 1.0});
  const double after = psnrOf(tube(), compact.grid);
  EXPECT_GE(after, before - 1.0);
  EXPECT_LT(after, before - 0.5);
}

TEST(CompactGrid, ComesAsNearAsItCanToAPsnrOutOfReach) {
  const auto compact = compactGrid(tube().grid, tube().source, {.psnr = 200.0});
  EXPECT_FALSE(compact.grid.quantised.empty());
  EXPECT_LT(compact.loss, 0.05);
}

TEST(CompactGrid, FillsTheBytesThatItMayHave) {
  for (const std::uint64_t bytes : {500u, 600u, 900u}) {
    const auto compact = compactGrid(tube().grid, tube().source, {.bytes = bytes});
    EXPECT_LE(compact.bytes, bytes);
    // With 60 ellipsoids, a step that is slightly too fine for one more bit of each costs 75 bytes.
    // Steps are tried to within half a percent.
    EXPECT_GE(compact.bytes, bytes - 20);
  }
}

TEST(CompactGrid, IsBetterTheMoreBytesItMayHave) {
  const auto lossAt = [](std::uint64_t bytes) {
    return compactGrid(tube().grid, tube().source, {.bytes = bytes}).loss;
  };
  EXPECT_GT(lossAt(400), lossAt(600));
  EXPECT_GT(lossAt(600), lossAt(900));
}

TEST(CompactGrid, KeepsTheBandOfALevelSet) {
  const Example ball = fitted(test::levelSetVolume(), true);
  const auto compact = compactGrid(ball.grid, ball.source);
  EXPECT_FALSE(compact.grid.quantised.empty());
  const double loss = psnrOf(ball, ball.grid) - psnrOf(ball, compact.grid);
  // The search and the metric sum in float64 over voxels of float32, as above.
  EXPECT_LE(loss, CompactOptions{}.loss + 1e-4);
  EXPECT_NEAR(compact.loss, loss, 1e-3);
  // A loss of 0.1 dB may move a hundredth of the band's voxels across its ends.
  EXPECT_GE(iouOf(ball, compact.grid), iouOf(ball, ball.grid) - 0.01);
}

TEST(CompactGrid, GivesTheSameBytesOnOneThread) {
  const auto many = bytesOf(compactGrid(tube().grid, tube().source).grid);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(bytesOf(compactGrid(tube().grid, tube().source).grid), many);
}

TEST(Compactor, ResultsDoNotDependOnTheOnesBefore) {
  const CompactOptions options{.loss = 0.2};
  encode::Compactor compactor(tube().grid, tube().source, options);
  const CompactResult first = compactor.toGoal();
  EXPECT_EQ(bytesOf(first.grid), bytesOf(compactGrid(tube().grid, tube().source, options).grid));
  const QuantiserSteps steps = encode::finer(first.steps, 1.0);
  const CompactResult second = compactor.at(steps);
  EXPECT_GT(second.bytes, first.bytes);
  encode::Compactor other(tube().grid, tube().source, options);
  EXPECT_EQ(bytesOf(second.grid), bytesOf(other.at(steps).grid));
  EXPECT_EQ(bytesOf(compactor.toGoal().grid), bytesOf(first.grid));
}

TEST(CompactGrid, OfNoEllipsoidsIsTheSame) {
  StoredGrid empty = tube().grid;
  for (auto& chunk : empty.field.chunks) chunk.ellipsoids = {};
  EXPECT_TRUE(compactGrid(empty, tube().source).grid.quantised.empty());
}

TEST(CompactGrid, RefusesKappasOfEachEllipsoid) {
  StoredGrid grid = tube().grid;
  Ellipsoids& e = grid.field.chunks[0].ellipsoids;
  e.kappa.assign(e.size(), 2.0f);
  EXPECT_THROW((void)compactGrid(grid, tube().source), RuntimeFailure);
}

}  // namespace
}  // namespace esvr
