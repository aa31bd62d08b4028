// Plan: the tests of intensity_cases.h run on a GPU. Passes over many overlapping ellipsoids agree
// with those of the CPU, and have the same bits in every run.

#include "fit/cuda/gpu_test.h"
#include "fit/intensity_cases.h"

namespace esvr {
namespace {

using test::Intensities;
INSTANTIATE_TEST_SUITE_P(Cuda, Intensities, testing::Values("cuda"));

class IntensitiesOnGpu : public test::CudaTest {};

struct Crowd {
  SparseVolume volume = test::tubeVolume();
  Field field = test::randomField(
      {.count = 3000, .extent = 40.0, .smallest = 0.5, .aspect = 4.0, .origin = {0, 0, 0}});
  test::ReaderRule rule;
  IntensityTarget target{volume, rule.rule, activeBox(volume)};
};

double largestOf(const std::vector<double>& values) {
  double largest = 0.0;
  for (const double v : values) largest = std::max(largest, std::abs(v));
  return largest;
}

void expectNear(const std::vector<double>& found, const std::vector<double>& expected,
                double tolerance) {
  ASSERT_EQ(found.size(), expected.size());
  const double allowed = tolerance * largestOf(expected);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], allowed) << i;
}

// Both sides are float32 sums over some hundred ellipsoids per voxel. On the GPU the unit of the
// sums is 2^-29 of their largest value. A voxel at the threshold that is exact on one side only
// would change the result by 1e-3.
TEST_F(IntensitiesOnGpu, AreMovedAsOnTheCpu) {
  const Crowd crowd;
  const auto cpu = makeIntensityPasses(crowd.target, {});
  const auto gpu = makeIntensityPasses(crowd.target, device_);
  cpu->setShapes(crowd.field);
  gpu->setShapes(crowd.field);
  std::vector<float> intensities(crowd.field.ellipsoidCount(), 0.01f);
  IntensityGradient expected, found;
  const StoredError error = cpu->gradient(intensities, expected);
  EXPECT_NEAR(gpu->gradient(intensities, found).squares, error.squares, 1e-4 * error.squares);
  EXPECT_NEAR(gpu->error(intensities).largest, error.largest, 1e-4);
  expectNear(found.byIntensity, expected.byIntensity, 1e-4);
  expectNear(found.curvature, expected.curvature, 1e-5);
  std::vector<double> normal, normalOnGpu;
  cpu->applyNormal(expected.byIntensity, normal);
  gpu->applyNormal(expected.byIntensity, normalOnGpu);
  expectNear(normalOnGpu, normal, 1e-4);
}

TEST_F(IntensitiesOnGpu, AreTheSameBitsInEveryRun) {
  const Crowd crowd;
  std::vector<std::vector<float>> runs;
  for (int run = 0; run < 3; ++run) {
    IntensityProblem problem(crowd.target, device_);
    problem.setShapes(crowd.field);
    runs.emplace_back(crowd.field.ellipsoidCount(), 0.01f);
    (void)problem.solve(runs.back(), 6);
  }
  EXPECT_EQ(runs[1], runs[0]);
  EXPECT_EQ(runs[2], runs[0]);
}

TEST_F(IntensitiesOnGpu, RefuseEllipsoidsThatReachTooManyBricks) {
  Crowd crowd;
  const auto passes = makeIntensityPasses(crowd.target, device_);
  // The bricks of 3 e^14 voxels, cubed, still have a number in 64 bits; those of e^32 have none.
  for (const float logScale : {14.0f, 32.0f}) {
    for (auto& plane : crowd.field.chunks[0].ellipsoids.logScale) plane[0] = logScale;
    EXPECT_THROW(passes->setShapes(crowd.field), DeviceError) << logScale;
  }
}

TEST_F(IntensitiesOnGpu, TakeOneKappaForAll) {
  Crowd crowd;
  Ellipsoids& e = crowd.field.chunks[0].ellipsoids;
  e.kappa.assign(e.size(), 2.0f);
  const auto passes = makeIntensityPasses(crowd.target, device_);
  EXPECT_THROW(passes->setShapes(crowd.field), RuntimeFailure);
}

}  // namespace
}  // namespace esvr
