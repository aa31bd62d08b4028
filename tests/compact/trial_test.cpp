// Plan: the errors of trials and of their layers agree with those of the decoded voxels, and
// several trials at once give the same results as single trials.

#include "compact/trial.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../fit/volumes.h"
#include "esvr/compact.h"
#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

StoredGrid storedOf(StoredGrid grid, const Trial& trial) {
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
    grid = makeStoredGrid({}, source, fit(source, options).field, {Activity::kByValue});
  }
};

TEST(Trial, HasTheErrorOfItsVoxels) {
  const Fitted fitted;
  TrialMaker maker(fitted.grid, {fitted.source, activeBox(fitted.source), {}});
  const Trial trial = maker.make({0.1, 0.1, 0.1, 0.1});
  const auto metrics = metricsOf(fitted.source, storedOf(fitted.grid, trial));
  const double squares = metrics.mseBox * metrics.boxVoxels;
  EXPECT_NEAR(trial.error, squares, 1e-6 * squares);  // float32 sums depend on the order
}

TEST(Trial, AmongSeveralIsTheSameAsAlone) {
  const Fitted fitted;
  TrialMaker maker(fitted.grid, {fitted.source, activeBox(fitted.source), {}});
  const QuantiserSteps steps[] = {{0.1, 0.1, 0.1, 0.1}, {0.05, 0.1, 0.2, 0.1}};
  const auto both = maker.make(steps);
  for (std::size_t k = 0; k < both.size(); ++k) {
    const Trial alone = maker.make(steps[k]);
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
  const StoredGrid grid = makeStoredGrid({}, source, field, {Activity::kByValue});
  TrialMaker maker(grid, {source, activeBox(source), {}});
  const Trial trial = maker.make({0.1, 0.1, 0.1, 0.1});
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

}  // namespace
}  // namespace esvr
