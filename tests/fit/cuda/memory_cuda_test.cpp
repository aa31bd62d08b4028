// Plan: a fit that runs out of device memory continues. Growth ends, lists are built after scratch
// memory is freed, and then ellipsoids are dropped. A fit with --max-vram holds no more than
// allowed and reports that it was limited; a fit that cannot begin reports it. The settings of the
// memory pool are restored, and nothing is held after a fit or a failure. On the host, a test
// checks which ellipsoids are dropped.

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <future>

#include "core/cuda/device_buffer.h"
#include "esvr/encode.h"
#include "fit/cuda/cuda_optimiser.h"
#include "fit/cuda/gpu_test.h"
#include "fit/cuda/memory_plan.h"
#include "fit/gradient_scene.h"
#include "fit/volumes.h"

namespace esvr {
namespace {

using cuda::CudaOptimiser;
using cuda::memoryAccount;

TEST(LeastUseful, AreTheLowestAndOfEqualOnesTheFirst) {
  const std::array values{3.0, 0.0, 2.0, 0.0, -1.0, 5.0};
  EXPECT_EQ(cuda::allButLowest(values, 0), (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(cuda::allButLowest(values, 2), (std::vector<std::size_t>{0, 2, 3, 5}));
  EXPECT_EQ(cuda::allButLowest(values, 10), std::vector<std::size_t>{});
}

/// Limits the bytes that all buffers together may hold, during its lifetime.
class HoldAtMost {
 public:
  explicit HoldAtMost(std::size_t bytes) : before_(memoryAccount().setLimit(bytes)) {}
  ~HoldAtMost() { memoryAccount().setLimit(before_); }

 private:
  std::size_t before_;
};

class MemoryOnGpu : public test::CudaTest {
 protected:
  SparseVolume volume_ = test::tubeVolume();
  FitTarget target_ = makeTarget(volume_, std::nullopt);
};

TEST_F(MemoryOnGpu, GrowthEndsWhereMemoryIsOut) {
  CudaOptimiser optimiser(target_, {}, {});
  optimiser.growTo(200);
  optimiser.iterate(std::vector<double>(10, 0.5));
  const double before = optimiser.measure().squaredSum;
  const HoldAtMost limit(memoryAccount().held());
  EXPECT_NO_THROW(optimiser.growTo(20'000));
  EXPECT_TRUE(optimiser.deviceFull());
  EXPECT_GE(optimiser.ellipsoidCount(), 150u);
  EXPECT_LT(optimiser.ellipsoidCount(), 20'000u);
  optimiser.iterate(std::vector<double>(30, 0.3));
  optimiser.relocate(10);
  optimiser.iterate(std::vector<double>(30, 0.3));
  EXPECT_LT(optimiser.measure().squaredSum, before);
  EXPECT_LE(memoryAccount().held(), memoryAccount().setLimit(cuda::MemoryAccount::kNoLimit));
}

TEST_F(MemoryOnGpu, ListsThatDoNotFitAreBuiltWithFewerEllipsoids) {
  CudaOptimiser optimiser(target_, {}, {});
  optimiser.growTo(2000);
  optimiser.iterate(std::vector<double>(10, 0.5));
  const std::size_t empty = memoryAccount().held() / 2;
  const HoldAtMost limit(empty);
  EXPECT_NO_THROW(optimiser.iterate(std::vector<double>(30, 0.5)));
  EXPECT_TRUE(optimiser.deviceFull());
  EXPECT_GT(optimiser.ellipsoidCount(), 0u);
  EXPECT_EQ(optimiser.ellipsoids().size(), optimiser.ellipsoidCount());
  EXPECT_TRUE(std::isfinite(optimiser.measure().squaredSum));
}

TEST_F(MemoryOnGpu, AFitStaysWithinWhatIsAllowedAndSaysThatItWasStopped) {
  const SparseVolume volume = test::volumeOf({}, 8, 0.0f, [](Coord v) {
    return float(std::max(0.0, 1.0 - std::hypot(v.x - 32, v.y - 32, v.z - 32) / 30.0));
  });
  FitOptions options;
  options.count = 20'000;
  options.iterations = 100;
  options.device = device_;
  const FitTarget target = makeTarget(volume, std::nullopt);
  // This is enough for the first ellipsoids and for some of the others.
  options.maxDeviceBytes = cuda::predictedBytes(target, 6000);
  const FitResult result = fit(volume, options);
  EXPECT_TRUE(result.deviceFull);
  EXPECT_GT(result.field.ellipsoidCount(), 3000u);
  EXPECT_LT(result.field.ellipsoidCount(), 20'000u);
  EXPECT_LE(result.deviceBytes, *options.maxDeviceBytes);
  EXPECT_GT(result.curve.back().psnrBox, 30.0);
  options.maxDeviceBytes = 1000;
  EXPECT_THROW((void)fit(volume, options), DeviceError);
}

std::uint64_t threshold() {
  int device = 0;
  cudaMemPool_t pool{};
  std::uint64_t value = 0;
  EXPECT_EQ(cudaGetDevice(&device), cudaSuccess);
  EXPECT_EQ(cudaDeviceGetDefaultMemPool(&pool, device), cudaSuccess);
  EXPECT_EQ(cudaMemPoolGetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &value), cudaSuccess);
  return value;
}

TEST_F(MemoryOnGpu, ThePoolsSettingsComeBack) {
  const std::uint64_t before = threshold();
  {
    auto first = std::make_unique<CudaOptimiser>(target_, OptimiserOptions{}, Tuning{});
    const CudaOptimiser second(target_, {}, {});
    EXPECT_EQ(threshold(), ~std::uint64_t{0});
    first.reset();
    EXPECT_EQ(threshold(), ~std::uint64_t{0});
  }
  EXPECT_EQ(threshold(), before);
}

TEST_F(MemoryOnGpu, NothingIsHeldAfterAFitOrAFailure) {
  const std::size_t before = memoryAccount().held();
  {
    CudaOptimiser optimiser(target_, {}, {});
    auto ellipsoids = test::randomEllipsoids(5, 1.0, 2.0);
    ellipsoids[2].intensity = std::nan("");
    optimiser.setEllipsoids(ellipsoids);
    EXPECT_GT(memoryAccount().held(), before);
    EXPECT_THROW(optimiser.iterate(std::array{1.0}), RuntimeFailure);
  }
  EXPECT_EQ(memoryAccount().held(), before);
  {
    const HoldAtMost limit(before + 1000);
    EXPECT_THROW(CudaOptimiser(target_, {}, {}), DeviceError);
  }
  EXPECT_EQ(memoryAccount().held(), before);
}

TEST_F(MemoryOnGpu, SlowASearchForAPsnrEndsWhereTheDeviceHoldsNoMoreEllipsoids) {
  const SparseVolume volume = test::volumeOf({}, 8, 0.0f, [](Coord v) {
    return float(std::max(0.0, 1.0 - std::hypot(v.x - 32, v.y - 32, v.z - 32) / 30.0));
  });
  const GridDescriptor descriptor;
  ConvertOptions options;
  options.goal = PsnrGoal{90.0};
  options.representation = Representation::kEllipsoids;
  options.fit.iterations = 100;
  options.fit.device = device_;
  options.fit.maxDeviceBytes = cuda::predictedBytes(makeTarget(volume, std::nullopt), 2000);
  const Conversion conversion = convertVolume({descriptor, volume}, options);
  EXPECT_EQ(conversion.fit.end, FitEnd::kPsnrMissed);
  EXPECT_TRUE(conversion.fit.deviceFull);
}

TEST_F(MemoryOnGpu, FitsAtTheSameTimeHaveTheirOwnLimitsAndFigures) {
  FitOptions small, large;
  small.count = 50, large.count = 500;
  for (FitOptions* options : {&small, &large}) {
    options->iterations = 60;
    options->device = device_;
  }
  small.maxDeviceBytes = cuda::predictedBytes(target_, 200);
  const std::size_t alone = fit(volume_, small).deviceBytes;
  auto other = std::async(std::launch::async, [&] { return fit(volume_, large); });
  const FitResult limited = fit(volume_, small);
  const FitResult free = other.get();
  EXPECT_EQ(limited.deviceBytes, alone);
  EXPECT_GT(free.deviceBytes, limited.deviceBytes);
  EXPECT_FALSE(free.deviceFull);
  EXPECT_EQ(free.field.ellipsoidCount(), fit(volume_, large).field.ellipsoidCount());
}

}  // namespace
}  // namespace esvr
