// Plan: results of a GPU meet the same goals as those of the CPU, measured by the CPU, and are the
// same in every run.

#include <gtest/gtest.h>

#include <utility>

#include "../fit/volumes.h"
#include "encode/rate_control.h"
#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "support/machine.h"

namespace esvr {
namespace {

using encode::compactGrid;

class CompactGridOnGpu : public test::OnGpu, public testing::WithParamInterface<bool> {
 protected:
  void SetUp() override {
    OnGpu::SetUp();
    if (IsSkipped()) return;
    const bool band = GetParam();
    source_ = band ? test::levelSetVolume() : test::tubeVolume();
    FitOptions options;
    options.count = 60;
    options.iterations = 150;
    options.kappa = 2.0f;
    options.narrowBand = band;
    GridDescriptor descriptor;
    if (band) descriptor.gridClass = GridClass::kLevelSet;
    grid_ = makeStoredGrid(descriptor, source_, fit(source_, options).field);
  }
  [[nodiscard]] double psnrOf(const StoredGrid& grid) const {
    return compareVolumes(source_, decodeGrid(grid)).psnrBox;
  }
  SparseVolume source_;
  StoredGrid grid_;
};

TEST_P(CompactGridOnGpu, CostsNoMoreThanWasAllowed) {
  const double before = psnrOf(grid_);
  for (const double loss : {0.05, 0.3, 2.0}) {
    const auto compact = compactGrid(grid_, source_, {.loss = loss, .device = device_});
    // The CPU sums the same field in another order.
    EXPECT_GE(psnrOf(compact.grid), before - loss - 1e-3) << loss;
  }
}

TEST_P(CompactGridOnGpu, ReachesThePsnrAskedFor) {
  const double psnr = psnrOf(grid_) - 1.0;
  const auto compact = compactGrid(grid_, source_, {.psnr = psnr, .device = device_});
  EXPECT_GE(psnrOf(compact.grid), psnr);
  EXPECT_LT(psnrOf(compact.grid), psnr + 0.5);
}

TEST_P(CompactGridOnGpu, TakesAboutTheBytesOfTheCpu) {
  const auto cpu = compactGrid(grid_, source_, {});
  const auto gpu = compactGrid(grid_, source_, {.device = device_});
  // The number of trials may differ by one, which is 7 % of the error or a tenth of about 60 bits.
  EXPECT_NEAR(double(gpu.bytes), double(cpu.bytes), 0.05 * double(cpu.bytes));
}

TEST_P(CompactGridOnGpu, GivesTheSameBytesInEveryRun) {
  const auto bytes = [&] {
    return encodeEsvr({{}, {compactGrid(grid_, source_, {.device = device_}).grid}});
  };
  const auto first = bytes();
  EXPECT_EQ(bytes(), first);
  EXPECT_EQ(bytes(), first);
}

TEST_P(CompactGridOnGpu, HoldsNearFloat32sOwnPrecision) {
  const SparseVolume source = test::ellipsoidVolume(300, 0.2, 1.0);
  // The volume was made from this field, so the error without rounding is zero.
  Field field =
      test::randomField({.count = 300, .extent = 30.0, .smallest = 1.5, .aspect = 2.0, .seed = 9});
  test::Random random(17);
  for (float& i : field.chunks[0].ellipsoids.intensity) i = float(random(0.2, 1.0));
  const StoredGrid grid = makeStoredGrid({}, source, std::move(field));
  const auto compact = compactGrid(grid, source, {.psnr = 105.0, .device = device_});
  EXPECT_GE(compareVolumes(source, decodeGrid(compact.grid)).psnrBox, 105.0);
}

INSTANTIATE_TEST_SUITE_P(FogAndBand, CompactGridOnGpu, testing::Bool());

}  // namespace
}  // namespace esvr
