// Plan: the tests check the division into subvolumes (every brick is in one, and sides follow the
// paper's rule), the initial ellipsoids, and the scaling of the schedule. On every device, a run
// lowers the error, clones and splits, prunes to the wanted count, learns k, ends at its time limit
// and when it is cancelled, and has the same bits in three runs and at a distant position. Wrong
// options are refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "../volumes.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/paper_method.h"
#include "fit/paper/paper_optimiser.h"
#include "fit/paper/population.h"
#include "support/on_device.h"

namespace esvr::paper {
namespace {

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
  BrickInput brick;
  brick.values.fill(0.5f);
  brick.active.setAll();
  const SparseVolume volume = makeVolume({brick}, 0.5f);
  EXPECT_EQ(fitByPaper(volume, {}).fit.field.ellipsoidCount(), 0u);
}

}  // namespace
}  // namespace esvr::paper
