// Plan: the kernels of every instruction set that this processor has agree with the baseline,
// forward and backward, for ellipsoids inside, across and outside a brick. Rows that they leave out
// contribute nothing, which a sum in float64 over all voxels shows. Sums differ by rounding
// only, so the tolerance is a few hundred float32 ulp of the sum of magnitudes. The loops of SSIM agree
// with the baseline up to rounding; such a sum has 11 products of numbers below 1 with weights whose sum
// is 1, so the tolerance is 1e-15.
//
// The tests check the weights of the window, its sums against three nested loops over each
// window, halos against single look-ups, and dilation. Sums have the same bits for every support
// that contains the values.
//
// Tolerance of sums: values and the sum of the weights are at most 1, and there are 33 additions
// with an error of 1.1e-16 each, so 1e-14 suffices.

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "esvr/volume.h"
#include "field/brick_kernels.h"
#include "field/random_field.h"
#include "field/ssim_window.h"

namespace esvr {
namespace {

constexpr std::array<float, 3> kCorner{8.0f, 8.0f, 8.0f};

struct Pass {
  alignas(64) std::array<float, 512> sum{};
  alignas(64) std::array<float, 512> phi{};
  PairMoments moments{};
};

std::vector<BrickForm> forms(float kappa) {
  const Field field =
      test::randomField({.count = 100, .extent = 24, .smallest = 0.4, .aspect = 20});
  const double radius = supportRadius(kernelConstants<double>({.kappa = kappa}));
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  std::vector<BrickForm> all;
  for (std::size_t i = 0; i < e.size(); ++i)
    all.push_back(makeBrickForm({e.center[0][i], e.center[1][i], e.center[2][i]}, unitFrame(e, i),
                                radius, e.intensity[i]));
  return all;
}

Pass run(const BrickKernels& kernels, const BrickForm& form, const KernelConstants<float>& k) {
  Pass pass;
  alignas(64) std::array<float, 512> residual;
  test::Random random(3);
  for (float& r : residual) r = float(random(-1.0, 1.0));
  PairTape tape{};
  tape.phi = pass.phi.data();
  kernels.forward(form, kCorner.data(), k, pass.sum.data(), tape);
  kernels.backward(form, kCorner.data(), k, residual.data(), tape, pass.moments);
  return pass;
}

class KernelSets : public testing::TestWithParam<float> {};

TEST_P(KernelSets, AgreeWithTheBaseline) {
  const auto k = kernelConstants<float>({.kappa = GetParam()});
  const auto sets = runnableKernels();
  ASSERT_STREQ(sets.back()->name, "baseline");
  for (const BrickForm& form : forms(GetParam())) {
    const Pass expected = run(*sets.back(), form, k);
    for (const BrickKernels* set : sets) {
      const Pass pass = run(*set, form, k);
      for (std::size_t v = 0; v < 512; ++v)
        ASSERT_NEAR(pass.sum[v], expected.sum[v], 1e-5 * std::max(1.0f, GetParam())) << set->name;
      const double scale = 1.0 + expected.moments.phi2;
      EXPECT_NEAR(pass.moments.phi2, expected.moments.phi2, 1e-4 * scale) << set->name;
      EXPECT_NEAR(pass.moments.rPhi, expected.moments.rPhi, 1e-4 * scale) << set->name;
      EXPECT_NEAR(pass.moments.w0x, expected.moments.w0x, 1e-2 * scale) << set->name;
      EXPECT_NEAR(pass.moments.w2, expected.moments.w2, 1e-1 * scale) << set->name;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Kappas, KernelSets, testing::Values(-30.0f, 2.0f, 5.0f));

TEST(BrickKernels, AddIsForwardWithoutItsTape) {
  const auto k = kernelConstants<float>(Kernel{});
  for (const BrickForm& form : forms(Kernel{}.kappa)) {
    const Pass pass = run(brickKernels(), form, k);
    alignas(64) std::array<float, 512> sum{};
    brickKernels().add(form, kCorner.data(), k, sum.data());
    EXPECT_EQ(sum, pass.sum);
  }
}

// Voxels as places have the values of a brick's rows, up to the rounding of t.
TEST(BrickKernels, PlacesAtVoxelsHaveTheirValues) {
  const auto k = kernelConstants<float>(Kernel{});
  alignas(64) std::array<float, 512> x, y, z;
  for (int v = 0; v < 512; ++v) {
    const Coord local = voxelLocal(v);
    x[v] = float(local.x), y[v] = float(local.y), z[v] = float(local.z);
  }
  const PlaceBlock places{x.data(), y.data(), z.data(), 512};
  const auto sets = runnableKernels();
  const auto placeKernels = runnablePlaceKernels();
  ASSERT_EQ(placeKernels.size(), sets.size());
  for (std::size_t set = 0; set < sets.size(); ++set)
    for (const BrickForm& form : forms(Kernel{}.kappa)) {
      alignas(64) std::array<float, 512> expected{}, sum{};
      sets[set]->add(form, kCorner.data(), k, expected.data());
      placeKernels[set](form, kCorner.data(), k, places, sum.data());
      for (int v = 0; v < 512; ++v) ASSERT_NEAR(sum[v], expected[v], 1e-5) << sets[set]->name;
    }
}

// The two sums may be contracted to fused operations in different ways: 512 roundings.
TEST(BrickKernels, AProjectionHasSumsOfTheMoments) {
  constexpr float kRounding = 512 * std::numeric_limits<float>::epsilon();
  const auto k = kernelConstants<float>(Kernel{});
  alignas(64) std::array<float, 512> residual, phi;
  test::Random random(3);
  for (float& r : residual) r = float(random(-1.0, 1.0));
  for (const BrickKernels* set : runnableKernels())
    for (const BrickForm& form : forms(Kernel{}.kappa)) {
      alignas(64) std::array<float, 512> sum{};
      PairTape tape{};
      tape.phi = phi.data();
      set->forward(form, kCorner.data(), k, sum.data(), tape);
      PairMoments moments{};
      PairProjection projection{};
      set->backward(form, kCorner.data(), k, residual.data(), tape, moments);
      set->project(tape, residual.data(), projection);
      EXPECT_NEAR(projection.rPhi, moments.rPhi, kRounding) << set->name;
      EXPECT_NEAR(projection.phi2, moments.phi2, kRounding * moments.phi2) << set->name;
    }
}

// A vector that the rows leave out contributes nothing, however thin, long or steep the ellipsoid is,
// and a row that is visited is mostly not empty.
TEST(BrickKernels, RowsAreThoseThatTheSupportMeets) {
  const Field field =
      test::randomField({.count = 400, .extent = 24, .smallest = 0.05, .aspect = 1000});
  const auto k = kernelConstants<double>(Kernel{});
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  for (const BrickKernels* set : runnableKernels()) {
    int visited = 0, empty = 0;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const Matrix3 L = unitFrame(e, i);
      const BrickForm form =
          makeBrickForm({e.center[0][i], e.center[1][i], e.center[2][i]}, L, supportRadius(k), 1.0);
      alignas(64) std::array<float, 512> sum{}, phi{};
      PairTape tape{};
      tape.phi = phi.data();
      set->forward(form, kCorner.data(), kernelConstants<float>(Kernel{}), sum.data(), tape);
      for (int v = 0; v < 512; ++v) {
        const Coord local = voxelLocal(v);
        double m = 0.0;
        for (std::size_t r = 0; r < 3; ++r)
          m += std::pow(L[3 * r] * (8.0 + local.x - e.center[0][i]) +
                            L[3 * r + 1] * (8.0 + local.y - e.center[1][i]) +
                            L[3 * r + 2] * (8.0 + local.z - e.center[2][i]),
                        2);
        ASSERT_NEAR(double(sum[v]), kernelPhi(k, m), 1e-3) << set->name << " " << i;
      }
      const int lanes = tape.rows ? tape.floats / std::popcount(tape.rows) : 8;
      for (int first = 0; first < tape.floats; first += lanes, ++visited)
        empty += std::all_of(&phi[first], &phi[first] + lanes, [](float p) { return p == 0.0f; });
    }
    EXPECT_GT(visited, 1000);
    EXPECT_LT(empty, visited / 5) << set->name;
  }
}

// Residuals start at -target, and sums are clamped to the range, also if it has no ends.
TEST(BrickKernels, ResidualsAreClamped) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  alignas(64) std::array<float, 512> target, r;
  test::Random random(4);
  for (float& t : target) t = float(random(0.0, 1.0));
  for (const BrickKernels* set : runnableKernels())
    for (const float end : {0.5f, kInfinity}) {
      set->start(target.data(), r.data());
      for (int v = 0; v < 512; ++v) r[v] += float(v) / 256.0f - 0.5f;
      double squares = 0.0;
      const double sum = set->finish(target.data(), -0.25f, end, r.data());
      for (int v = 0; v < 512; ++v) {
        const float value = std::clamp(float(v) / 256.0f - 0.5f, -0.25f, end);
        ASSERT_NEAR(r[v], value - target[v], 3e-7f) << set->name;
        squares += double(r[v]) * double(r[v]);
      }
      EXPECT_NEAR(sum, squares, 1e-5 * squares);
    }
}

TEST(BrickKernels, MomentsAreSummedInFloat64) {
  std::vector<PairMoments> moments(1000);
  for (PairMoments& m : moments) m = {1e8f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1.0f};
  moments[0].w0x = 1.0f;
  for (const BrickKernels* set : runnableKernels()) {
    MomentTotals sums;
    set->sumMoments(moments.data(), moments.size(), sums);
    EXPECT_EQ(sums.front(), 999e8 + 1.0) << set->name;
    EXPECT_EQ(sums.back(), 1000.0) << set->name;
  }
}

// The loops of SSIM.

constexpr double kTolerance = 1e-15;
constexpr int kCount = 93, kStride = 19;  // not multiples of any vector length

std::vector<double> randomValues(std::size_t count, std::uint64_t seed) {
  test::Random random(seed);
  std::vector<double> values(count);
  for (double& v : values) v = random(-1.0, 1.0);
  return values;
}

void expectSame(const std::vector<double>& values, const std::vector<double>& expected,
                const SsimKernels& set) {
  for (std::size_t i = 0; i < expected.size(); ++i)
    ASSERT_NEAR(values[i], expected[i], kTolerance) << set.name << " at " << i;
}

template <class Run>
void expectSameOfAllSets(std::size_t count, Run run) {
  const auto sets = runnableSsimKernels();
  ASSERT_STREQ(sets.back()->name, "baseline");
  std::vector<double> expected(count), values(count);
  run(*sets.back(), expected.data());
  for (const SsimKernels* set : sets) {
    run(*set, values.data());
    expectSame(values, expected, *set);
  }
}

TEST(SsimKernels, SumTapsAgreesWithTheBaseline) {
  const auto weights = ssimWeights();
  const auto in = randomValues(kCount + kStride * (kSsimTaps - 1), 1);
  expectSameOfAllSets(kCount, [&](const SsimKernels& set, double* out) {
    set.sumTaps(weights.data(), in.data(), kStride, out, kCount);
  });
}

TEST(SsimKernels, SumRowsAgreesWithTheBaseline) {
  const auto weights = ssimWeights();
  const auto in = randomValues(5 * kHaloSide, 2);
  expectSameOfAllSets(5 * kBrickSide, [&](const SsimKernels& set, double* out) {
    set.sumRows(weights.data(), in.data(), out, 5);
  });
}

TEST(SsimKernels, MultiplyAgreesWithTheBaseline) {
  const auto a = randomValues(kCount, 3), b = randomValues(kCount, 4);
  expectSameOfAllSets(kCount, [&](const SsimKernels& set, double* out) {
    set.multiply(a.data(), b.data(), out, kCount);
  });
}

TEST(SsimWindow, WeightsSumToOneAndFallAsAGaussian) {
  const auto w = ssimWeights();
  EXPECT_NEAR(std::accumulate(w.begin(), w.end(), 0.0), 1.0, 1e-15);
  EXPECT_NEAR(w[6] / w[5], std::exp(-1.0 / 4.5), 1e-15);
  EXPECT_EQ(w[0], w[10]);
}

TEST(SsimWindow, ClippedWeightsSumWhatTheBoxLeaves) {
  const SsimWindow window;
  const auto w = ssimWeights();
  EXPECT_NEAR(window.weightWithin(100, 0, 1000), 1.0, 1e-15);
  EXPECT_DOUBLE_EQ(window.weightWithin(7, 7, 7), w[5]);
  EXPECT_NEAR(window.weightWithin(0, 0, 1000), (1.0 + w[5]) / 2.0, 1e-15);
}

std::unique_ptr<HaloValues> randomHalo(const Box& support) {
  test::Random random(3);
  auto halo = std::make_unique<HaloValues>();
  for (int x = support.min.x; x <= support.max.x; ++x)
    for (int y = support.min.y; y <= support.max.y; ++y)
      for (int z = support.min.z; z <= support.max.z; ++z)
        (*halo)[std::size_t(haloOffset(x, y, z))] = random(-1.0, 1.0);
  return halo;
}

double directSum(const HaloValues& halo, Coord voxel) {
  const auto w = ssimWeights();
  double sum = 0.0;
  for (int x = 0; x < kSsimTaps; ++x)
    for (int y = 0; y < kSsimTaps; ++y)
      for (int z = 0; z < kSsimTaps; ++z)
        sum += w[std::size_t(x)] * w[std::size_t(y)] * w[std::size_t(z)] *
               halo[std::size_t(haloOffset(voxel.x + x, voxel.y + y, voxel.z + z))];
  return sum;
}

class SsimWindowSupport : public testing::TestWithParam<Box> {};

TEST_P(SsimWindowSupport, SumsAreThoseOfEachWindowAlone) {
  const auto halo = randomHalo(GetParam());
  SsimWindow window;
  BrickSums sums;
  window.sum(*halo, {GetParam(), kWholeBrick}, sums);
  for (int v = 0; v < kBrickVoxels; v += 7)
    EXPECT_NEAR(sums[std::size_t(v)], directSum(*halo, voxelLocal(v)), 1e-14) << v;
}

TEST_P(SsimWindowSupport, ALargerSupportGivesTheSameBits) {
  const auto halo = randomHalo(GetParam());
  SsimWindow used, window;
  BrickSums sums, whole;
  used.sum(*randomHalo(kWholeHalo), {kWholeHalo, kWholeBrick}, sums);  // leaves other sums behind
  used.sum(*halo, {GetParam(), kWholeBrick}, sums);
  window.sum(*halo, {kWholeHalo, kWholeBrick}, whole);
  EXPECT_EQ(sums, whole);
}

TEST_P(SsimWindowSupport, WindowsElsewhereSumToZero) {
  const auto halo = randomHalo(GetParam());
  SsimWindow window;
  BrickSums sums;
  window.sum(*halo, {GetParam(), kWholeBrick}, sums);
  const Box reached = windowsThatSee(GetParam());
  for (int v = 0; v < kBrickVoxels; ++v)
    EXPECT_EQ(sums[std::size_t(v)] != 0.0, reached.contains(voxelLocal(v))) << v;
}

TEST(SsimWindow, SumsOfFewVoxelsReadNoMoreThanTheySee) {
  const auto halo = randomHalo(kWholeHalo);
  const Box voxels{{2, 3, 0}, {4, 3, 7}}, seen = seenByWindows(voxels);
  SsimWindow window;
  BrickSums sums, whole;
  window.sum(*halo, {kWholeHalo, kWholeBrick}, whole);
  for (int i = 0; i < kHaloVoxels; ++i)
    if (!seen.contains({i / (kHaloSide * kHaloSide), i / kHaloSide % kHaloSide, i % kHaloSide}))
      (*halo)[std::size_t(i)] = std::numeric_limits<double>::quiet_NaN();
  window.sum(*halo, {kWholeHalo, voxels}, sums);
  for (int v = 0; v < kBrickVoxels; ++v)
    if (voxels.contains(voxelLocal(v))) {
      EXPECT_EQ(sums[std::size_t(v)], whole[std::size_t(v)]) << v;
    }
}

INSTANTIATE_TEST_SUITE_P(Boxes, SsimWindowSupport,
                         testing::Values(kWholeHalo, Box{{13, 0, 5}, {17, 17, 12}},
                                         Box{{5, 0, 13}, {12, 4, 17}}, Box{{0, 0, 0}, {0, 0, 0}},
                                         Box{{17, 17, 17}, {17, 17, 17}}, Box{}));

TEST(BrickHalo, HoldsTheBrickAndItsNeighbours) {
  const std::vector<Coord> bricks{{-1, -1, -1}, {0, 0, 0}, {-1, 0, 1}, {1, 0, -1}, {5, 5, 5}};
  const BrickIndex index(bricks);
  std::vector<float> values(bricks.size() * kBrickVoxels);
  std::iota(values.begin(), values.end(), 1.0f);
  const BricksAround around = bricksAround(index, {0, 0, 0});
  ValuesAround<float> arrays{};
  for (std::size_t i = 0; i < around.size(); ++i)
    if (around[i] != BrickIndex::kNone) arrays[i] = &values[around[i] * kBrickVoxels];
  const auto halo = std::make_unique<HaloValues>();
  halo->fill(-1.0);
  const Box seen{{0, 1, 0}, {17, 14, 17}};
  fillHalo(arrays, seen, *halo);
  for (int i = 0; i < kHaloVoxels; ++i) {
    const Coord at{i / (kHaloSide * kHaloSide) - kSsimRadius,
                   i / kHaloSide % kHaloSide - kSsimRadius, i % kHaloSide - kSsimRadius};
    const auto b = index.find(brickOf(at));
    double want = 0.0;
    if (b != BrickIndex::kNone)
      want = double(values[b * kBrickVoxels + std::size_t(voxelOffset(localOf(at)))]);
    if (!seen.contains(at + Coord{kSsimRadius, kSsimRadius, kSsimRadius})) want = -1.0;
    ASSERT_EQ((*halo)[std::size_t(i)], want) << toString(at);
  }
}

TEST(BrickHalo, SupportHoldsTheBoxesOfTheBricksAsFarAsWindowsReach) {
  const std::vector<Coord> bricks{{-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {0, -1, 0}};
  const BrickIndex index(bricks);
  const std::vector<Box> boxes{kWholeBrick, {{1, 2, 3}, {1, 2, 3}}, Box{}, {{0, 0, 0}, {7, 2, 7}}};
  // Nothing of the last brick lies within reach of (0, 0, 0), because it ends at y = -6.
  EXPECT_EQ(haloSupport(bricksAround(index, {0, 0, 0}), boxes), (Box{{0, 5, 5}, {6, 12, 16}}));
  EXPECT_EQ(haloSupport(bricksAround(index, {-2, 1, 0}), boxes), (Box{{13, 0, 5}, {17, 4, 12}}));
  EXPECT_TRUE(haloSupport(bricksAround(index, {0, 0, -2}), boxes).empty());
  EXPECT_TRUE(haloSupport(bricksAround(index, {9, 9, 9}), boxes).empty());
}

TEST(DilateBricks, AddsTheTwentySixNeighboursOnce) {
  const std::vector<Coord> one{{-1, 0, 4}};
  const auto grown = dilateBricks(one);
  EXPECT_EQ(grown.size(), 27u);
  EXPECT_EQ(grown.front(), (Coord{-2, -1, 3}));
  EXPECT_EQ(grown.back(), (Coord{0, 1, 5}));

  const std::vector<Coord> two{{0, 0, 0}, {0, 0, 1}};
  const auto both = dilateBricks(two);
  EXPECT_EQ(both.size(), 36u);
  EXPECT_TRUE(std::is_sorted(both.begin(), both.end()));
}

}  // namespace

}  // namespace esvr
