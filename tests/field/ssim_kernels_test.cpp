// Plan: the kernels of every instruction set that this processor has agree with the baseline up to
// rounding. A sum has 11 products of numbers below 1 with weights whose sum is 1, so the tolerance
// is 1e-15.

#include "field/ssim_kernels.h"

#include <gtest/gtest.h>

#include "field/random_field.h"
#include "field/ssim_window.h"

namespace esvr {
namespace {

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

}  // namespace
}  // namespace esvr
