// Plan: the solution against one of dense normal equations in float64, exact data recovered, and
// voxels that come back exactly left alone.

#include "fit/intensity_problem.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "esvr/field.h"
#include "esvr/metrics.h"
#include "fit/volumes.h"

namespace esvr {
namespace {

constexpr StoredValue kAsItIs{{}, -1.0f};  // every voxel active

Field someField() {
  return test::randomField(
      {.count = 12, .extent = 14.0, .smallest = 1.5, .aspect = 2.0, .origin = {6, 16, 11}});
}

IntensityTarget targetOf(const SparseVolume& volume) {
  return {volume, kAsItIs, activeBox(volume)};
}

TEST(IntensityProblem, FindsTheIntensitiesThatMadeTheVolume) {
  const Field truth = someField();
  const SparseVolume volume = revoxelise(truth, {});
  IntensityProblem problem(truth, targetOf(volume));
  std::vector<float> guess(truth.primitiveCount(), 0.1f);
  guess[3] = -0.1f;  // signs are allowed then
  EXPECT_GT(problem.error(guess), 1.0);
  // 12 unknowns: exact after 12 steps but for rounding in float32 brick sums
  EXPECT_LT(problem.solve(guess, 30), 1e-7);
  const auto& wanted = truth.chunks[0].ellipsoids.intensity;
  for (std::size_t i = 0; i < guess.size(); ++i) EXPECT_NEAR(guess[i], wanted[i], 1e-3) << i;
}

using Row = std::vector<double>;

/// Cholesky's way, in place. \return x of A x = b
Row solved(std::vector<Row> A, Row b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t r = k + 1; r < n; ++r) {
      const double f = A[r][k] / A[k][k];
      for (std::size_t c = k; c < n; ++c) A[r][c] -= f * A[k][c];
      b[r] -= f * b[k];
    }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t c = k + 1; c < n; ++c) b[k] -= A[k][c] * b[c];
    b[k] /= A[k][k];
  }
  return b;
}

/// Every ellipsoid alone, with an intensity of 1.
std::vector<Field> kernelsOf(const Field& field) {
  std::vector<Field> kernels(field.primitiveCount(), field);
  for (std::size_t i = 0; i < kernels.size(); ++i) {
    auto& intensity = kernels[i].chunks[0].ellipsoids.intensity;
    std::fill(intensity.begin(), intensity.end(), 0.0f);
    intensity[i] = 1.0f;
  }
  return kernels;
}

TEST(IntensityProblem, AgreesWithDenseNormalEquations) {
  const Field field = someField();
  const SparseVolume volume = test::tubeVolume();
  IntensityProblem problem(field, targetOf(volume));
  std::vector<float> solution(field.primitiveCount(), -0.01f);
  (void)problem.solve(solution, 60);

  const auto kernels = kernelsOf(field);
  std::vector<Row> normal(solution.size(), Row(solution.size()));
  Row right(solution.size());
  const auto add = [&](Coord voxel, double wanted) {
    Row phi;
    for (const Field& kernel : kernels) phi.push_back(evaluateReference(kernel, voxel));
    for (std::size_t r = 0; r < phi.size(); ++r) {
      right[r] += phi[r] * wanted;
      for (std::size_t c = 0; c < phi.size(); ++c) normal[r][c] += phi[r] * phi[c];
    }
  };
  // all voxels that a support reaches, and all of the volume's
  for (std::int32_t x = 0; x < 40; ++x)
    for (std::int32_t y = 0; y < 40; ++y)
      for (std::int32_t z = 0; z < 40; ++z) {
        const auto at = findBrick(volume, brickOf(Coord{x, y, z} - volume.origin));
        const int offset = voxelOffset(localOf({x, y, z}));
        add({x, y, z}, at ? double(volume.brickValues(*at)[std::size_t(offset)]) : 0.0);
      }
  const Row exact = solved(normal, right);
  // sums over a brick are float32: 1e-6 of sums of about 100, over curvatures of about 10
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_NEAR(solution[i], exact[i], 1e-4) << i;
    EXPECT_NEAR(problem.curvature()[i], normal[i][i], 1e-4 * normal[i][i]);
  }
}

TEST(IntensityProblem, MeasuresTheErrorThatAReaderGets) {
  const Field field = someField();
  const SparseVolume volume = test::tubeVolume();
  const RevoxeliseOptions rule{.threshold = 0.2f, .range = ValueRange{0.0f, 0.9f}};
  const StoredValue stored{{.range = rule.range}, rule.threshold};
  IntensityProblem problem(field, {volume, stored, activeBox(volume)});
  const auto metrics = compareVolumes(volume, revoxelise(field, rule));
  EXPECT_NEAR(problem.error(intensitiesOf(field)), metrics.mseBox * metrics.boxVoxels, 1e-6);
}

TEST(IntensityProblem, NeverTurnsASignWhereThereIsNone) {
  const Field field = someField();
  const SparseVolume volume = test::tubeVolume();
  IntensityProblem problem(field, targetOf(volume));
  std::vector<float> intensities(field.primitiveCount(), 0.2f);
  const double before = problem.error(intensities);
  EXPECT_LE(problem.solve(intensities, 20), before);
  for (const float i : intensities) EXPECT_GE(i, 0.0f);
}

TEST(IntensityProblem, GivesTheSameBitsOnOneThread) {
  const Field field = someField();
  const SparseVolume volume = test::tubeVolume();
  std::vector<float> many(field.primitiveCount(), 0.2f), one = many;
  IntensityProblem(field, targetOf(volume)).solve(many, 10);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  IntensityProblem(field, targetOf(volume)).solve(one, 10);
  EXPECT_EQ(many, one);
}

}  // namespace
}  // namespace esvr
