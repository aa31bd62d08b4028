// Plan: on the host, the units of integer sums are such that no sum can overflow; they are as fine
// as that allows, and stay within the range of floats for extreme values. On a GPU, the sum of a
// brick with 60,000 entries whose signs nearly cancel agrees with float64, and so do lists of about
// the length at which sums become 64-bit integers.

#include "core/cuda/integer_sum.cuh"

#include <cmath>
#include <cstdint>

#include "fit/cuda/cuda_optimiser.h"
#include "fit/cuda/gpu_test.h"
#include "fit/gradient_scene.h"
#include "fit/volumes.h"

namespace esvr {
namespace {

using cuda::kLimits32;
using cuda::kLimits64;
using cuda::SumLimits;
using cuda::unitExponent;

TEST(IntegerSum, NeverLeavesItsBits) {
  test::Random random(3);
  for (int n = 0; n < 10'000; ++n) {
    const auto largest = float(std::exp2(random(-60, 60)));
    const auto count = std::uint32_t(std::exp2(random(0, 31)));
    for (const SumLimits& limits : {kLimits32, kLimits64, SumLimits{21, 29}}) {
      const int e = unitExponent(largest, count, limits);
      const double sum = double(largest) * count * std::exp2(e);
      EXPECT_LT(sum, std::exp2(limits.sumBits + 1) * (1 + 1e-6)) << largest << " " << count;
      EXPECT_LT(double(largest) * std::exp2(e), std::exp2(limits.valueBits + 1));
      if (std::abs(e) == 126) continue;
      EXPECT_TRUE(sum >= std::exp2(limits.sumBits) * (1 - 1e-6) ||
                  double(largest) * std::exp2(e) >= std::exp2(limits.valueBits));
    }
  }
}

TEST(IntegerSum, OfNothingOrExtremesHasUnitsThatFloatsHave) {
  EXPECT_EQ(unitExponent(0.0f, 10, kLimits32), 0);
  EXPECT_EQ(unitExponent(1.0f, 0, kLimits32), 0);
  EXPECT_EQ(unitExponent(std::nanf(""), 10, kLimits32), 0);
  EXPECT_EQ(unitExponent(1e-45f, 1, kLimits64), 126);
  EXPECT_GE(unitExponent(3e38f, 4'000'000'000u, kLimits32), -126);
}

TEST(WideBricks, AreAtMostAsManyAsThePairsAllow) {
  cuda::PassScene scene{};
  scene.brickCount = 100;
  scene.ellipsoidCount = 1'000'000;
  scene.pairCount = cuda::kMaxNarrowEntries - 1;
  EXPECT_EQ(cuda::maxWideBricks(scene), 0u);
  scene.pairCount = 3 * cuda::kMaxNarrowEntries + 5;
  EXPECT_EQ(cuda::maxWideBricks(scene), 3u);
  scene.pairCount = 4'000'000'000u;
  EXPECT_EQ(cuda::maxWideBricks(scene), 100u);
  scene.ellipsoidCount = cuda::kMaxNarrowEntries;  // no list can be longer
  EXPECT_EQ(cuda::maxWideBricks(scene), 0u);
}

/// Pairs of ellipsoids at the same place whose intensities differ by 2^-18, all near one brick.
std::vector<Ellipsoid> cancellingPairs(std::size_t count) {
  test::Random random(11);
  std::vector<Ellipsoid> ellipsoids;
  while (ellipsoids.size() < count) {
    const double l = 1.0 / random(0.6, 1.0);
    Ellipsoid p{{11.5 + random(-2, 2), 11.5 + random(-2, 2), 11.5 + random(-2, 2)},
                {l, 0, 0, 0, l, 0, 0, 0, l},
                1.0};
    ellipsoids.push_back(p);
    p.intensity = -1.0 + 0x1p-18;
    ellipsoids.push_back(p);
  }
  return ellipsoids;
}

/// The sum over all voxels of the squared sum of ellipsoids, in float64.
double squaredSum(const std::vector<Ellipsoid>& ellipsoids, const Kernel& kernel) {
  const auto k = kernelConstants<double>(kernel);
  double sum = 0.0;
  for (int x = 0; x < 24; ++x)
    for (int y = 0; y < 24; ++y)
      for (int z = 0; z < 24; ++z) {
        double value = 0.0;
        for (const Ellipsoid& p : ellipsoids) {
          const double d2 = std::pow(x - p.center[0], 2) + std::pow(y - p.center[1], 2) +
                            std::pow(z - p.center[2], 2);
          value += p.intensity * kernelPhi(k, d2 * p.L[0] * p.L[0]);
        }
        sum += value * value;
      }
  return sum;
}

class LongListsOnGpu : public test::CudaTest, public testing::WithParamInterface<std::size_t> {};

// With 32 bits, 60,000 entries have units of 2^-13, and the rounding of all of them would add at
// least 3 % to the squares. The units of short lists are finer; their rounding adds at most 0.4 %.
TEST_P(LongListsOnGpu, SumAsPreciselyAsFloat64) {
  const SparseVolume volume = test::volumeOf({}, 3, 0.0f, [](Coord) { return 0.5f; });
  FitTarget target = makeTarget(volume, std::nullopt);
  std::fill(target.values.begin(), target.values.end(), 0.0f);
  const auto ellipsoids = cancellingPairs(GetParam());
  OptimiserOptions options;
  cuda::CudaOptimiser optimiser(target, options, {});
  optimiser.setEllipsoids(ellipsoids);
  const double expected = squaredSum(ellipsoids, options.kernel);
  EXPECT_NEAR(optimiser.measure().squaredSum, expected, 1e-2 * expected);
}
INSTANTIATE_TEST_SUITE_P(Lengths, LongListsOnGpu,
                         testing::Values(64u, 4096u, 4098u, 20'000u, 60'000u));

}  // namespace
}  // namespace esvr
