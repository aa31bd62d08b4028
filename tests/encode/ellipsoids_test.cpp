// Plan: the search for ellipsoids of a PSNR continues its short fit and its first whole fit instead of
// beginning again with seeds, and makes no more whole fits than it promises. A search that is cancelled
// keeps its best fit. Large ellipsoids are fitted to averages of voxels where these suffice. Forecasts say where ellipsoids cannot win. Intensities have both signs where this is
// better, and only there: a gyroid with a plateau is such a volume; smooth blobs are not.

#include "encode/ellipsoids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "encode/ellipsoids.h"
#include "encode/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

using encode::EllipsoidSearch;

constexpr std::uint32_t kWholeFit = 400;

/// A search in a volume, with options that outlive it.
struct Searched {
  GridDescriptor descriptor;
  SparseVolume volume;
  ConvertOptions options;
  ConvertInput input{descriptor, volume};
  EllipsoidSearch search;

  Searched(SparseVolume of, ConvertOptions with, const encode::Aim& goal,
           std::optional<encode::FitPoint> scout = {})
      : volume(std::move(of)),
        options(std::move(with)),
        search({input, options, nullptr, scout}, goal) {}
};

ConvertOptions ofIterations(std::uint32_t iterations) {
  ConvertOptions options;
  options.fit.iterations = iterations;
  options.fit.kappa = 2.0f;
  return options;
}

TEST(EllipsoidSearch, SlowReachesAPsnrOrSaysThatItDoesNot) {
  std::set<std::uint32_t> iterations;
  for (const double psnr : {28.0, 30.0, 32.0, 34.0, 36.0, 38.0}) {
    Searched made(test::tubeVolume(), ofIterations(kWholeFit), {.psnr = psnr});
    made.search.draft();
    const auto found = made.search.run();
    EXPECT_EQ(found->fit.end == FitEnd::kPsnrReached,
              psnrOverBox(made.volume, decodeGrid(found->grid)) >= psnr);
    EXPECT_LE(found->fit.curve.back().iteration, kWholeFit);
    iterations.insert(found->fit.curve.back().iteration);
  }
  EXPECT_GT(iterations.size(), 1u) << "fits for more bytes are longer, and continued ones shorter";
}

TEST(EllipsoidSearch, MakesNoMoreWholeFitsThanItPromises) {
  ConvertOptions options = ofIterations(120);
  int fits = 0;
  double last = 1.0;
  options.fit.progress = [&](const FitProgress& progress) {
    fits += progress.fraction < last;
    last = progress.fraction;
  };
  Searched made(test::noiseVolume(2), options, {.psnr = 90.0});
  made.search.draft();
  fits = 0;
  EXPECT_EQ(made.search.run()->fit.end, FitEnd::kPsnrMissed);
  EXPECT_LE(fits, encode::planOf({made.input, made.options}).wholeFits);
}

TEST(EllipsoidSearch, SlowProbesBeforeTheLongFitsOfTheHighPreset) {
  for (const Preset preset : {Preset::kStandard, Preset::kHigh}) {
    ConvertOptions options = ofIterations(800);
    options.fit.preset = preset;
    std::vector<std::uint32_t> lengths;  // iterations of the probe and of the whole fits
    double last = 1.0;
    options.fit.progress = [&](const FitProgress& progress) {
      if (progress.fraction < last) lengths.push_back(0);
      lengths.back() = progress.point.iteration;
      last = progress.fraction;
    };
    Searched made(test::noiseVolume(3), options, {.psnr = 22.0});
    made.search.draft();
    lengths.clear(), last = 1.0;
    EXPECT_EQ(made.search.run()->fit.end, FitEnd::kPsnrReached);
    EXPECT_GT(made.search.expectedBytes(), 4096u) << "shorter fits do";
    const bool isProbed = lengths.size() > 1 && lengths.front() < 200;
    EXPECT_EQ(isProbed, preset == Preset::kHigh);
    EXPECT_LE(lengths.size(), preset == Preset::kHigh ? 4u : 2u);
  }
}

TEST(EllipsoidSearch, SlowFitsLargeEllipsoidsToAveragesWhereTheseSuffice) {
  constexpr double kWidth = 2.0;
  // Averages of blobs that are two voxels wide have errors that 40 dB allow and 52 dB do not.
  for (const double psnr : {40.0, 52.0}) {
    test::Random random(7);
    std::array<std::array<double, 3>, 60> blobs;
    for (auto& [x, y, z] : blobs) x = random(8, 72), y = random(8, 72), z = random(8, 72);
    const auto volume = test::volumeOf({}, 10, 0.0f, [&](Coord v) {
      double sum = 0.0;
      for (const auto& [x, y, z] : blobs) {
        const double r = (v.x - x) * (v.x - x) + (v.y - y) * (v.y - y) + (v.z - z) * (v.z - z);
        if (r < 20.0 * kWidth * kWidth) sum += std::exp(-0.5 * r / (kWidth * kWidth));
      }
      return float(0.01 + sum);
    });
    ConvertOptions options = ofIterations(200);
    options.fit.kappa = 0.0f;
    Searched made(volume, options, {.psnr = psnr}, encode::FitPoint{240.0, psnr - 1.0});
    made.search.draft();
    const auto found = made.search.run();
    EXPECT_EQ(found->fit.end, FitEnd::kPsnrReached);
    EXPECT_GE(psnrOverBox(made.volume, decodeGrid(found->grid)), psnr);
    const double share = double(found->fit.pairs) / estimateWork(found->grid.field).pairs;
    EXPECT_EQ(share < 0.5, psnr < 50.0) << share << " of the pairs of an ellipsoid and a brick";
  }
}

TEST(EllipsoidSearch, KeepsItsFirstFitWhereItIsCancelled) {
  CancelToken cancel;
  ConvertOptions options;
  options.fit.iterations = 1'000'000;
  options.fit.cancel = &cancel;
  options.fit.progress = [&](const FitProgress&) { cancel.cancel(); };
  Searched made(test::tubeVolume(), options, {.psnr = 60.0});
  made.search.draft();
  const auto found = made.search.run();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->fit.end, FitEnd::kCancelled);
  EXPECT_GT(found->grid.field.ellipsoidCount(), 0u);
}

TEST(EllipsoidSearch, EndsWhereItsShortFitsAreCancelled) {
  CancelToken cancel;
  cancel.cancel();
  Searched made(test::tubeVolume(), ofIterations(60), {.psnr = 28.0});
  EXPECT_THROW(made.search.draft(&cancel), Cancelled);
  EXPECT_FALSE(made.search.hasDraft());
}

TEST(EllipsoidSearch, ForecastsWhatCannotWin) {
  Searched noise(test::noiseVolume(3), ofIterations(60), {.psnr = 45.0});
  noise.search.stayBelow(20000);
  noise.search.draft();
  EXPECT_FALSE(noise.search.mayStayBelow(20000));
  Searched smooth(test::smoothVolume(), ofIterations(200), {.psnr = 35.0});
  smooth.search.stayBelow(100'000);
  smooth.search.draft();
  EXPECT_TRUE(smooth.search.mayStayBelow(100'000));
  EXPECT_GT(smooth.search.expectedBytes(), 0u);
  Searched sized(test::smoothVolume(), ofIterations(200), {.bytes = 2000});
  sized.search.draft();
  EXPECT_TRUE(sized.search.mayReach(sized.search.expectedPsnr()));
  EXPECT_FALSE(sized.search.mayReach(sized.search.expectedPsnr() + 10.0));
}

TEST(EllipsoidSearch, FillsASize) {
  for (const std::uint64_t bytes : {1200u, 4000u}) {
    Searched made(test::smoothVolume(), ofIterations(100), {.bytes = bytes});
    made.search.draft();
    const auto found = made.search.run();
    ASSERT_TRUE(found);
    EXPECT_LE(bytesAdded(found->grid), bytes);
    EXPECT_GE(double(bytesAdded(found->grid)), 0.97 * double(bytes));
  }
}

TEST(EllipsoidSearch, SaysWhatASizeThatIsTooSmallNeeds) {
  Searched made(test::smoothVolume(), ofIterations(60), {.bytes = 60});
  made.search.draft();
  EXPECT_FALSE(made.search.run());
}

// One ellipsoid is off by its cut border alone, and a second one hardly helps.
TEST(EllipsoidSearch, ReachesAPsnrThatOneEllipsoidMissesByLittle) {
  const SparseVolume blob = test::volumeOf({}, 5, 0.0f, [](Coord v) {
    const double x = v.x - 19.5, y = v.y - 19.5, z = v.z - 19.5;
    const double value = std::exp(-8.0 / (19.5 * 19.5) * (x * x + y * y + z * z));
    return value < 0.01 ? 0.0f : float(value);
  });
  for (const double psnr : {36.0, 38.0, 40.0, 42.0}) {
    ConvertOptions options;
    options.goal = PsnrGoal{psnr};
    options.representation = Representation::kEllipsoids;
    const Conversion found = convertVolume({{}, blob}, options);
    EXPECT_EQ(found.fit.end, FitEnd::kPsnrReached) << psnr;
    EXPECT_LT(bytesAdded(found.grid), 600u) << psnr;
  }
}

TEST(Plan, GivesLessTimeToLargeVolumesOfACpuAndToLittleEffort) {
  const SparseVolume volume = test::noiseVolume(2);
  const GridDescriptor descriptor;
  ConvertOptions options;
  const auto planFor = [&](const SparseVolume& source, int effort) {
    options.effort = effort;
    return encode::planOf({{descriptor, source}, options});
  };
  std::uint32_t before = 0;
  for (int effort = kLeastEffort; effort <= kUsualEffort; ++effort) {
    const encode::Plan plan = planFor(volume, effort);
    EXPECT_GT(plan.wholeIterations, before);
    EXPECT_LE(plan.shortIterations, plan.wholeIterations);
    EXPECT_TRUE(plan.fitsInTime);
    before = plan.wholeIterations;
  }
  EXPECT_EQ(planFor(volume, kMostEffort).wholeIterations, before) << "longer fits gain nothing";
  SparseVolume large;  // the plan looks at the number of bricks alone
  large.bricks.resize(10'000);
  EXPECT_GT(planFor(large, kUsualEffort + 1).wholeIterations,
            planFor(large, kUsualEffort).wholeIterations);
  EXPECT_LE(planFor(large, kMostEffort).wholeIterations, before);
  EXPECT_TRUE(planFor(large, kUsualEffort).improves);
  large.bricks.resize(40'000);
  const encode::Plan plan = planFor(large, kUsualEffort);
  EXPECT_GE(plan.wholeIterations, 160u) << "fewer do not show what ellipsoids can reach";
  EXPECT_GE(plan.shortIterations, 50u);
  EXPECT_FALSE(plan.improves) << "a fit that reaches its PSNR is the last one";
  large.bricks.resize(400'000);
  EXPECT_FALSE(planFor(large, kUsualEffort).fitsInTime);
}

// ---- Signs

/// A gyroid whose inside is a plateau. Many of its borders are concave.
SparseVolume gyroidVolume() {
  constexpr double kTurns = 2.0 * std::numbers::pi / 22.0;  // a period of 22 voxels
  return test::volumeOf({}, 4, 0.0f, [](Coord v) {
    const double x = kTurns * v.x, y = kTurns * v.y, z = kTurns * v.z;
    const double g =
        std::sin(x) * std::cos(y) + std::sin(y) * std::cos(z) + std::sin(z) * std::cos(x);
    return float(std::clamp(2.0 * g, 0.0, 1.0));
  });
}

const GridDescriptor& descriptor() {
  static const GridDescriptor grid = [] {
    GridDescriptor g;
    g.name = "density";
    return g;
  }();
  return grid;
}

ConvertOptions searching(const Goal& goal) {
  ConvertOptions options;
  options.goal = goal;
  options.representation = Representation::kEllipsoids;
  options.fit.iterations = 800;
  return options;
}

Conversion converted(const SparseVolume& volume, const ConvertOptions& options) {
  return convertVolume({descriptor(), volume}, options);
}

double psnrOf(const SparseVolume& volume, const Conversion& conversion) {
  return compareVolumes(volume, decodeGrid(conversion.grid)).psnrBox;
}

TEST(Signs, SlowAreBothForAGyroidOfAGivenSize) {
  const SparseVolume gyroid = gyroidVolume();
  ConvertOptions options = searching(SizeGoal{6000});
  const Conversion free = converted(gyroid, options);
  options.fit.bothSigns = false;
  const Conversion positive = converted(gyroid, options);
  EXPECT_TRUE(free.fit.signedIntensities);
  EXPECT_FALSE(positive.fit.signedIntensities);
  EXPECT_GT(psnrOf(gyroid, free), psnrOf(gyroid, positive) + 1.0);
}

TEST(Signs, SlowAreChosenAfterAShortFit) {
  const Conversion conversion = converted(gyroidVolume(), searching(PsnrGoal{40.0}));
  EXPECT_TRUE(conversion.fit.signedIntensities);
}

TEST(Signs, AreThoseOfTheValuesWhereFewAreExtreme) {
  ConvertOptions options = searching(SizeGoal{1500});
  options.fit.iterations = 60;
  EXPECT_FALSE(encode::saturates(test::smoothVolume())) << "a fit with both signs would be made";
  EXPECT_FALSE(converted(test::smoothVolume(), options).fit.signedIntensities);
}

TEST(Signs, OfAnOptionAreKept) {
  ConvertOptions options = searching(SizeGoal{1500});
  options.fit.iterations = 60;
  options.fit.bothSigns = false;
  const Conversion conversion = converted(gyroidVolume(), options);
  EXPECT_FALSE(conversion.fit.signedIntensities);
}

}  // namespace
}  // namespace esvr
