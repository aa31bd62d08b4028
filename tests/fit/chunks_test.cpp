// Plan: every brick belongs to one chunk, and the chunks' boxes fill space. Planes halve the bricks. A box that grows ends
// where coordinates end. A volume whose fit exceeds the memory is divided. The ellipsoids of the chunks add up to the wanted
// number and keep to their limits, equal chunks get equal numbers, and where the numbers are the best ones, moving an
// ellipsoid does not lower the error.
//
// The bytes of a part's end give the end back, and damaged bytes are refused. The key of a part changes with everything
// that the result depends on, and with nothing else.
//
// Constants of a target act like ellipsoids that are not fitted. A fit in chunks is nearly as good as a fit in one chunk,
// also at the seams, gives the same bits again, on any number of threads and of workers, continues from a field, and ends
// when it is cancelled. A volume that fits into one chunk is fitted as usual.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/fit.h"
#include "esvr/metrics.h"
#include "esvr/workers.h"
#include "fit/chunks/chunks.h"
#include "fit/cpu/cpu_pass.h"
#include "fit/gradient_scene.h"
#include "fit/volumes.h"
#include "support/machine.h"

namespace esvr {
namespace {

// The division of a volume.

TEST(DivideBricks, GivesEveryBrickToTheChunkWhoseBoxContainsIt) {
  const SparseVolume volume = test::tubeVolume();
  const auto chunks = divideBricks(volume, 5);
  ASSERT_GT(chunks.size(), 4u);
  std::set<std::uint32_t> seen;
  for (const BrickChunk& chunk : chunks) {
    EXPECT_LE(chunk.bricks.size(), 5u);
    std::uint64_t active = 0;
    for (const std::uint32_t b : chunk.bricks) {
      EXPECT_TRUE(seen.insert(b).second);
      EXPECT_TRUE(chunk.bounds.contains(volume.bricks[b]));
      active += std::uint64_t(volume.active[b].count());
    }
    EXPECT_EQ(active, chunk.activeVoxels);
  }
  EXPECT_EQ(seen.size(), volume.brickCount());
}

TEST(DivideBricks, MakesBoxesThatFillSpaceWithoutOverlap) {
  const auto chunks = divideBricks(test::tubeVolume(), 10);
  for (const Coord place : {Coord{0, 0, 0}, Coord{2, 3, 1}, Coord{-100, 2, 5},
                            Coord{Box::kMax, Box::kMin, 0}, Coord{Box::kMin, 0, Box::kMax}})
    EXPECT_EQ(std::count_if(chunks.begin(), chunks.end(),
                            [&](const BrickChunk& c) { return c.box.contains(place); }),
              1);
}

TEST(DivideBricks, EndsAtSingleBricks) {
  const SparseVolume volume = test::volumeOf({}, 2, 0.0f, [](Coord) { return 1.0f; });
  for (const std::size_t most : {0, 1}) {
    const auto chunks = divideBricks(volume, most);
    ASSERT_EQ(chunks.size(), 8u);
    for (const BrickChunk& chunk : chunks) EXPECT_EQ(chunk.activeVoxels, 512u);
  }
}

/// A volume whose bricks are at these places on the x axis.
SparseVolume columnOf(const std::vector<int>& places) {
  SparseVolume volume;
  for (const int x : places) volume.bricks.push_back({x, 0, 0});
  volume.values.resize(places.size() * kBrickVoxels);
  volume.active.resize(places.size());
  return volume;
}

std::vector<std::size_t> sizesOf(const std::vector<BrickChunk>& chunks) {
  std::vector<std::size_t> sizes;
  for (const BrickChunk& chunk : chunks) sizes.push_back(chunk.bricks.size());
  return sizes;
}

TEST(DivideBricks, HalvesTheBricks) {
  using testing::ElementsAre;
  EXPECT_THAT(sizesOf(divideBricks(columnOf({0, 1, 2, 3, 4, 5, 6, 7}), 4)), ElementsAre(4, 4));
  EXPECT_THAT(sizesOf(divideBricks(columnOf({0, 1, 2}), 2)), ElementsAre(1, 2));
  EXPECT_THAT(sizesOf(divideBricks(columnOf({0, 1'000'000}), 1)), ElementsAre(1, 1));
  EXPECT_THAT(sizesOf(divideBricks(columnOf({0, 1, 2, 100'000'000}), 2)), ElementsAre(2, 2));
}

TEST(DivideBricks, PutsThePlaneWhereBothSidesAreNearlyEqual) {
  SparseVolume volume;  // six bricks at 0, one at 1 and one at 2
  for (int y = 0; y < 6; ++y) volume.bricks.push_back({0, y % 2, y / 2});
  volume.bricks.push_back({1, 0, 0});
  volume.bricks.push_back({9, 0, 0});
  volume.values.resize(8 * kBrickVoxels);
  volume.active.resize(8);
  EXPECT_THAT(sizesOf(divideBricks(volume, 7)), testing::ElementsAre(6, 2));
}

TEST(Dilated, EndsWhereCoordinatesEnd) {
  const Box all = dilated(Box::whole(), 3);
  EXPECT_EQ(all, Box::whole());
  EXPECT_EQ(dilated({{1, 2, 3}, {4, 5, 6}}, 2), (Box{{-1, 0, 1}, {6, 7, 8}}));
}

/// A row of bricks whose voxels are all active.
SparseVolume rowOfBricks(std::int32_t count) {
  SparseVolume volume;
  for (std::int32_t x = 0; x < count; ++x) volume.bricks.push_back({x, 0, 0});
  volume.active.resize(volume.brickCount());
  for (BrickMask& mask : volume.active) mask.setAll();
  volume.values.assign(volume.brickCount() * kBrickVoxels, 1.0f);
  return volume;
}

// A fit takes about 8 KB of the host's memory for each brick (divide.cpp).
TEST(ChunksFor, DividesAVolumeWhoseFitExceedsTheMemoryOfTheHost) {
  const SparseVolume volume = rowOfBricks(2000);
  FitOptions options;
  options.count = 100;
  EXPECT_LE(chunksFor(volume, options).size(), 1u);
  options.maxHostBytes = 20'000'000;
  EXPECT_LE(chunksFor(volume, options).size(), 1u);
  options.maxHostBytes = 9'500'000;
  EXPECT_EQ(chunksFor(volume, options).size(), 2u);
}

std::size_t sumOf(const std::vector<std::size_t>& numbers) {
  return std::accumulate(numbers.begin(), numbers.end(), std::size_t{0});
}

TEST(DivideCount, GivesEqualChunksEqualNumbers) {
  const std::vector<ChunkNeed> needs(4, {2.0, 10.0, 0, 1000});
  EXPECT_EQ(dividedCount(100, needs), (std::vector<std::size_t>{25, 25, 25, 25}));
  EXPECT_EQ(sumOf(dividedCount(101, needs)), 101u);
}

TEST(DivideCount, LowersTheErrorThatFallsWith45DbPerDoubling) {
  const std::vector<ChunkNeed> needs{{1.0, 100.0, 0, 100000}, {50.0, 100.0, 0, 100000}};
  const auto numbers = dividedCount(10000, needs);
  const auto errorOf = [&](double first, double second) {
    const double power = 0.45 / std::log10(2.0);
    return needs[0].error * std::pow(first / 100.0, -power) +
           needs[1].error * std::pow(second / 100.0, -power);
  };
  const double a = double(numbers[0]), b = double(numbers[1]);
  EXPECT_LT(errorOf(a, b), errorOf(a + 100.0, b - 100.0));
  EXPECT_LT(errorOf(a, b), errorOf(a - 100.0, b + 100.0));
}

TEST(DivideCount, KeepsToTheLimits) {
  const std::vector<ChunkNeed> needs{
      {1.0, 10.0, 70, 1000}, {1.0, 10.0, 0, 5}, {1.0, 10.0, 0, 1000}};
  const auto numbers = dividedCount(100, needs);
  EXPECT_EQ(numbers, (std::vector<std::size_t>{70, 5, 25}));
}

TEST(DivideCount, GivesNothingToChunksWithoutError) {
  const std::vector<ChunkNeed> needs{{0.0, 10.0, 0, 1000}, {1.0, 10.0, 0, 1000}};
  EXPECT_EQ(dividedCount(50, needs), (std::vector<std::size_t>{0, 50}));
}

TEST(DivideCount, KeepsMoreThanTheCountWhereChunksHaveThem) {
  const std::vector<ChunkNeed> needs{{1.0, 30.0, 30, 1000}, {1.0, 30.0, 30, 1000}};
  EXPECT_EQ(dividedCount(50, needs), (std::vector<std::size_t>{30, 30}));
}

// Parts.

PartEnd someEnd() {
  PartEnd end;
  end.fit = stateOf(test::randomEllipsoids(20, 1.0, 3.0));
  end.fit.adam[3].steps = 17;
  end.kernel.kappa = 3.5f;
  end.errors = {1.0, 2.0, 3.0, 4.0};
  end.pairs = 99;
  end.end = FitEnd::kTimeUp;
  end.deviceFull = true;
  end.secondsSeed = 0.25;
  return end;
}

TEST(PartBytes, GiveThePartBack) {
  const PartEnd end = someEnd(), back = partOf(bytesOf(end));
  EXPECT_EQ(back.fit.ellipsoids.size(), 20u);
  EXPECT_EQ(back.fit.ellipsoids[7].center, end.fit.ellipsoids[7].center);
  EXPECT_EQ(back.fit.adam[3].steps, 17u);
  EXPECT_EQ(back.kernel, end.kernel);
  EXPECT_EQ(back.errors.squaredSumActive, 3.0);
  EXPECT_EQ(back.end, FitEnd::kTimeUp);
  EXPECT_EQ(bytesOf(back), bytesOf(end));
}

TEST(PartBytes, AreRefusedWhereTheyAreCutOrLonger) {
  auto bytes = bytesOf(someEnd());
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}, bytes.size() - 1})
    EXPECT_THROW((void)partOf(std::span(bytes).first(size)), BadInput) << size;
  bytes.push_back({});
  EXPECT_THROW((void)partOf(bytes), BadInput);
}

class PartKeys : public testing::Test {
 protected:
  /// The key after a change of the scene, the options or the start.
  struct Inputs {
    SparseVolume volume = test::tubeVolume();
    FitOptions options;
    PartStart start;
    int halo = 2;
  };
  static PartKey keyAfter(const std::function<void(Inputs&)>& change) {
    Inputs in;
    in.start.plan.start = stateOf(test::randomEllipsoids(5, 1.0, 2.0));
    in.start.ghosts = test::randomEllipsoids(3, 1.0, 2.0);
    change(in);
    const auto chunks = divideBricks(in.volume, 10);
    return keyOf(FitScene{in.volume, chunks, scaleOf(in.volume), boxOf(in.volume, std::nullopt),
                          in.halo, in.options},
                 in.start);
  }
};

TEST_F(PartKeys, ChangeWithAllThatTheResultDependsOn) {
  const std::vector<std::function<void(Inputs&)>> changes{
      [](Inputs&) {},
      [](Inputs& in) { in.volume.brickValues(0)[100] += 0.125f; },
      [](Inputs& in) { in.options.seed = 2; },
      [](Inputs& in) { in.options.device.kind = DeviceKind::kCuda; },
      [](Inputs& in) { in.options.narrowBand = true; },
      [](Inputs& in) { in.options.bothSigns = true; },
      [](Inputs& in) { in.halo = 3; },
      [](Inputs& in) { in.start.chunk = 1; },
      [](Inputs& in) { in.start.kernel.kappa = 5.0f; },
      [](Inputs& in) { in.start.plan.iterations = 7; },
      [](Inputs& in) { in.start.plan.count = 7; },
      [](Inputs& in) { in.start.plan.to = 0.5; },
      [](Inputs& in) { in.start.plan.learnKappa = true; },
      [](Inputs& in) { in.start.plan.psnr = 40.0; },
      [](Inputs& in) { in.start.plan.start.ellipsoids[2].intensity += 1.0; },
      [](Inputs& in) { in.start.plan.start.adam[2].m[0] = 1.0f; },
      [](Inputs& in) { in.start.ghosts[0].center[0] += 1.0; }};
  std::set<PartKey> keys;
  for (const auto& change : changes) EXPECT_TRUE(keys.insert(keyAfter(change)).second);
}

TEST_F(PartKeys, AreTheSameWhereTheResultIs) {
  const PartKey key = keyAfter([](Inputs&) {});
  EXPECT_EQ(keyAfter([](Inputs& in) { in.options.device.index = 3; }), key);
  EXPECT_EQ(keyAfter([](Inputs& in) { in.options.progress = [](const FitProgress&) {}; }), key);
  EXPECT_EQ(keyAfter([](Inputs& in) { in.start.pairs = 5; }), key);
}

// Fits in chunks.

constexpr std::uint64_t kChunkVoxels = 2000;

/// The chunks of a fit with kChunkVoxels.
std::vector<BrickChunk> chunksOf(const SparseVolume& volume) {
  FitOptions options;
  options.chunkVoxels = kChunkVoxels;
  return chunksFor(volume, options);
}

FitScene sceneOf(const SparseVolume& volume, std::span<const BrickChunk> chunks) {
  static const FitOptions options;
  return {volume, chunks, scaleOf(volume), boxOf(volume, std::nullopt), 2, options};
}

std::vector<float> residualsOf(const FitTarget& target, const Kernel& kernel,
                               const std::vector<Ellipsoid>& ellipsoids) {
  CpuPass pass(target, kernelConstants<double>(kernel));
  pass.rebuild(ellipsoids, 1.0);
  std::vector<float> residuals;
  pass.residuals(ellipsoids, residuals);
  residuals.resize(target.values.size());
  return residuals;
}

class Constants : public testing::TestWithParam<bool> {};

// Both sides are float32 sums of 60 ellipsoids with intensities of at most 1.
TEST_P(Constants, ActLikeEllipsoidsThatAreNotFitted) {
  const SparseVolume volume = test::denseVolume();
  const Kernel kernel{.kappa = 2.0f};
  const auto all = test::randomEllipsoids(60, 1.0, 3.0);
  const std::vector<Ellipsoid> fitted(all.begin(), all.begin() + 30),
      ghosts(all.begin() + 30, all.end());
  const auto chunks = divideBricks(volume, volume.brickCount());
  const FitScene scene = sceneOf(volume, chunks);
  ChunkTarget part(scene, chunks.front(), {ghosts, kernel});
  ASSERT_FALSE(part.target.constants.empty());
  part.target.saturates = GetParam();
  FitTarget whole = makeTarget(volume, std::nullopt);
  whole.saturates = GetParam();
  const auto found = residualsOf(part.target, kernel, fitted);
  const auto expected = residualsOf(whole, kernel, all);
  for (std::size_t v = 0; v < expected.size(); ++v) ASSERT_NEAR(found[v], expected[v], 1e-5) << v;
}
INSTANTIATE_TEST_SUITE_P(Sums, Constants, testing::Bool(), [](const auto& saturates) {
  return saturates.param ? "Clamped" : "NotClamped";
});

TEST(ChunkTarget, CountsItsOwnVoxelsOnly) {
  const SparseVolume volume = test::tubeVolume();
  const auto chunks = divideBricks(volume, 10);
  const FitScene scene = sceneOf(volume, chunks);
  std::uint64_t counted = 0;
  double boxVoxels = 0.0;
  for (const BrickChunk& chunk : chunks) {
    const ChunkTarget part(scene, chunk, {});
    for (const BrickMask& mask : part.counted) counted += std::uint64_t(mask.count());
    boxVoxels += part.target.boxVoxels;
  }
  EXPECT_EQ(counted, activeVoxelCount(volume));
  EXPECT_EQ(boxVoxels, scene.box.volume());
}

/// A long tube that winds through several chunks.
SparseVolume longTube() {
  return test::volumeOf({-8, 16, 0}, 12, 0.0f, [](Coord v) {
    const double axis = 60.0 + 20.0 * std::sin(v.x * 0.1);
    const double r = std::hypot(v.y - axis, v.z - 44.0 - 15.0 * std::cos(v.x * 0.07));
    return r < 7.0 ? float(std::min(1.0, (7.0 - r) / 3.0)) : 0.0f;
  });
}

FitOptions shortFit(std::optional<std::uint64_t> chunkVoxels) {
  FitOptions options;
  options.count = 300;
  options.iterations = 150;
  options.chunkVoxels = chunkVoxels;
  return options;
}

SparseVolume decoded(const FitResult& result) {
  return revoxelise(result.field, {.threshold = 0.01f, .range = result.range});
}

class ChunksOn : public test::OnDevice {
 protected:
  [[nodiscard]] FitResult fitted(std::optional<std::uint64_t> chunkVoxels) const {
    FitOptions options = shortFit(chunkVoxels);
    options.device = device_;
    return fit(volume_, options);
  }
  SparseVolume volume_ = longTube();
};

// Chunks of 2000 voxels are extreme: their halo has more bricks than they have themselves.
// The fit loses 1.0 dB in them.
TEST_P(ChunksOn, SlowAreNearlyAsGoodAsOneChunk) {
  const FitResult one = fitted(std::nullopt), several = fitted(kChunkVoxels);
  EXPECT_GT(several.chunks, 4u);
  EXPECT_GT(psnrOverBox(volume_, decoded(several)), psnrOverBox(volume_, decoded(one)) - 1.5);
  EXPECT_LE(several.field.ellipsoidCount(), 300u);
  EXPECT_GT(several.field.ellipsoidCount(), 290u);
  EXPECT_NEAR(several.curve.back().psnrBox, psnrOverBox(volume_, decoded(several)), 0.3);
}

TEST_P(ChunksOn, SlowGiveTheSameBitsAgain) {
  EXPECT_TRUE(test::sameBits(fitted(kChunkVoxels).field, fitted(kChunkVoxels).field));
}
ESVR_ON_DEVICES(ChunksOn);

/// Squared error per voxel, in the bricks that border on another chunk or in the others.
double errorIn(const SparseVolume& volume, const SparseVolume& found, bool atSeams) {
  const auto chunks = chunksOf(volume);
  double squares = 0.0, voxels = 0.0;
  for (const BrickChunk& chunk : chunks)
    for (const std::uint32_t b : chunk.bricks) {
      const Box near = dilated({volume.bricks[b], volume.bricks[b]}, 1);
      const bool isAtSeam = common(near, chunk.box) != near;
      if (isAtSeam != atSeams) continue;
      for (int v = 0; v < kBrickVoxels; ++v) {
        if (!volume.active[b].test(v)) continue;
        const Coord at = volume.brickCorner(b) + voxelLocal(v);
        squares += std::pow(double(valueAt(volume, at)) - double(valueAt(found, at)), 2);
        voxels += 1.0;
      }
    }
  EXPECT_GT(voxels, 1000.0);
  return squares / voxels;
}

// Both errors are 1.3 times those of a fit in one chunk.
TEST(FitInChunks, SlowIsNearlyAsGoodAtTheSeams) {
  const SparseVolume volume = longTube();
  const SparseVolume one = decoded(fit(volume, shortFit(std::nullopt)));
  const SparseVolume several = decoded(fit(volume, shortFit(kChunkVoxels)));
  const double atSeams = errorIn(volume, several, true) / errorIn(volume, one, true);
  const double inside = errorIn(volume, several, false) / errorIn(volume, one, false);
  EXPECT_LT(inside, 1.5);
  EXPECT_LT(atSeams, 1.15 * inside);
}

TEST(FitInChunks, GivesTheSameBitsOnAnyNumberOfThreads) {
  const SparseVolume volume = longTube();
  FitOptions options = shortFit(kChunkVoxels);
  options.iterations = 20;
  const auto run = [&] { return fit(volume, options).field; };
  EXPECT_TRUE(test::sameBits(test::onThreads(1, run), run()));
}

TEST(FitInChunks, GivesTheSameBitsOnSeveralWorkers) {
  const SparseVolume volume = longTube();
  FitOptions options = shortFit(kChunkVoxels);
  options.iterations = 40;
  const FitResult usual = fit(volume, options);
  for (const std::size_t count : {2, 4}) {
    DeviceWorkers workers{std::vector<Device>(count)};
    options.parts = &workers;
    EXPECT_TRUE(test::sameBits(fit(volume, options).field, usual.field)) << count;
  }
}

TEST(FitInChunks, IsTheUsualFitInOneChunk) {
  const SparseVolume volume = test::tubeVolume();
  FitOptions options = shortFit(activeVoxelCount(volume));
  options.iterations = 20;
  const FitResult chunked = fit(volume, options);
  options.chunkVoxels.reset();
  EXPECT_TRUE(test::sameBits(fit(volume, options).field, chunked.field));
}

TEST(FitInChunks, SlowContinuesFromAField) {
  const SparseVolume volume = longTube();
  FitOptions options = shortFit(kChunkVoxels);
  const FitResult first = fit(volume, options);
  options.start = &first.field;
  options.count = 450;
  const FitResult more = fit(volume, options);
  EXPECT_GT(more.field.ellipsoidCount(), 400u);
  EXPECT_GT(psnrOverBox(volume, decoded(more)), psnrOverBox(volume, decoded(first)) + 1.0);
}

TEST(FitInChunks, ReportsProgressOfTheWholeFit) {
  FitOptions options = shortFit(kChunkVoxels);
  options.iterations = 30;  // rounds then end between iterations
  double last = 0.0;
  bool grows = true;
  options.progress = [&](const FitProgress& p) {
    grows = grows && p.fraction >= last;
    last = p.fraction;
  };
  (void)fit(longTube(), options);
  EXPECT_TRUE(grows);
  EXPECT_LE(last, 1.0);
}

TEST(WholeProgress, DoesNotGoBackWhereAPartEnds) {
  const SparseVolume volume = test::tubeVolume();
  const auto chunks = divideBricks(volume, 10);
  const FitScene scene = sceneOf(volume, chunks);
  std::vector<double> fractions;
  WholeProgress progress(scene, [&](const FitProgress& p) { fractions.push_back(p.fraction); });
  FitProgress now;
  now.fraction = 0.26;  // the part has ended at a whole iteration
  progress.of(0)(now);
  progress.end(0, {}, 0.25);
  ASSERT_EQ(fractions.size(), 2u);
  EXPECT_GT(fractions[0], 0.0);
  EXPECT_EQ(fractions[1], fractions[0]);
}

TEST(FitInChunks, KeepsTheChunksThatWereFittedBeforeItWasCancelled) {
  CancelToken cancel;
  FitOptions options = shortFit(kChunkVoxels);
  options.cancel = &cancel;
  options.progress = [&](const FitProgress& p) {
    if (p.fraction > 0.3) cancel.cancel();
  };
  const FitResult result = fit(longTube(), options);
  EXPECT_EQ(result.end, FitEnd::kCancelled);
  EXPECT_GT(result.field.ellipsoidCount(), 0u);
  EXPECT_LT(result.field.ellipsoidCount(), 250u);
}

TEST(FitInChunks, SlowSaysWhetherItReachedAPsnr) {
  FitOptions options = shortFit(kChunkVoxels);
  options.psnr = 35.0;
  const FitResult reached = fit(longTube(), options);
  EXPECT_EQ(reached.end, FitEnd::kPsnrReached);
  EXPECT_GT(reached.curve.back().psnrBox, 35.0);
  options.psnr = 80.0;
  EXPECT_EQ(fit(longTube(), options).end, FitEnd::kPsnrMissed);
}

TEST(FitInChunks, DoesNotDependOnWhereTheVolumeIs) {
  SparseVolume volume = longTube();
  FitOptions options = shortFit(kChunkVoxels);
  options.iterations = 20;
  const FitResult here = fit(volume, options);
  for (const int shift : {10'000'000, -10'000'000}) {
    volume.origin = volume.origin + Coord{shift, -shift, shift};
    const FitResult there = fit(volume, options);
    EXPECT_EQ(there.curve.back().psnrBox, here.curve.back().psnrBox) << shift;
    EXPECT_EQ(there.field.ellipsoidCount(), here.field.ellipsoidCount()) << shift;
  }
}

TEST(FitInChunks, FitsPartsThatAreFarFromEachOther) {
  const SparseVolume volume = test::volumeOf({}, 2, 0.0f, [](Coord v) {
    return float(std::exp(-0.05 * (std::pow(v.x - 8, 2) + std::pow(v.y - 8, 2))));
  });
  SparseVolume both = volume;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    both.bricks.push_back(volume.bricks[b] + Coord{2'500'000, 0, 0});
  both.values.insert(both.values.end(), volume.values.begin(), volume.values.end());
  both.active.insert(both.active.end(), volume.active.begin(), volume.active.end());
  FitOptions options = shortFit(kChunkVoxels);
  options.count = 40;
  const FitResult result = fit(both, options);
  EXPECT_GT(result.chunks, 1u);
  EXPECT_GT(result.curve.back().psnrActive, 30.0);
}

/// A field with one ellipsoid, with its longest scale along x.
Field longEllipsoid(float scale) {
  Field field;
  field.chunks.resize(1);
  Ellipsoids& e = field.chunks[0].ellipsoids;
  e.resize(1);
  e.center[0] = {40.0f}, e.center[1] = {60.0f}, e.center[2] = {44.0f};
  e.logScale[0] = {std::log(scale)}, e.logScale[1] = e.logScale[2] = {1.0f};
  e.rotation[0] = {1.0f};
  e.intensity = {0.5f};
  return field;
}

TEST(FitInChunks, SlowTakesAnEllipsoidThatReachesAcrossFiveChunks) {
  const Field field = longEllipsoid(20.0f);
  FitOptions options = shortFit(1000);
  options.start = &field;
  const FitResult result = fit(longTube(), options);
  EXPECT_GT(result.chunks, 8u);
  EXPECT_GT(result.curve.back().psnrBox, 40.0);
}

TEST(FitInChunks, LeavesOutAChunkWithoutData) {
  SparseVolume volume = longTube();
  const std::size_t half = volume.brickCount() / 2;
  std::fill(volume.values.begin() + std::ptrdiff_t(half * kBrickVoxels), volume.values.end(), 0.0f);
  FitOptions options = shortFit(kChunkVoxels);
  options.iterations = 20;
  EXPECT_GT(fit(volume, options).field.ellipsoidCount(), 0u);
}

TEST(FitInChunks, RefusesChunksWithoutVoxels) {
  EXPECT_THROW((void)fit(test::tubeVolume(), shortFit(0)), UsageError);
}

}  // namespace
}  // namespace esvr
