#pragma once
/// Tests for each device: the comparisons that gradients must pass, for the ellipsoids of gradient_scene.h; and the solution
/// of intensities, which agrees with that of dense normal equations in float64. Exact data is recovered, errors are those of
/// a reader, voxels that a reader gets exactly are left out, and nothing depends on the field before.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "esvr/field.h"
#include "esvr/metrics.h"
#include "fit/gradient_scene.h"
#include "fit/intensity_problem.h"
#include "fit/volumes.h"
#include "support/machine.h"

namespace esvr::test {

// ---- Gradients

/// Compares every gradient with differences: each parameter alone, and kappa at fixed scales.
inline void expectDifferences(const SmallTarget& target, const GradientCase& c,
                              const std::vector<Ellipsoid>& ellipsoids,
                              const std::vector<double>& g,
                              const std::vector<EllipsoidGradient>& gradients) {
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    const Differences expected = differencesOf(target, c, ellipsoids[i], g);
    const double tolerance = toleranceOf(c, ellipsoids[i]) * expected.magnitude;
    ASSERT_GT(expected.magnitude, 0.0) << "an ellipsoid that no voxel sees proves nothing";
    for (int n = 0; n < kParameters; ++n)
      EXPECT_NEAR(gradients[i].byParameter[n], expected.by[n], tolerance)
          << "ellipsoid " << i << ", parameter " << n;
    EXPECT_NEAR(gradients[i].byKappa, expected.by[kParameters], tolerance)
        << "ellipsoid " << i << ", by kappa";
  }
}

/// Checks <g, dV> = <dL, dtheta> for a random direction dtheta of all parameters and kappa.
inline void expectAdjointIdentity(const SmallTarget& target, const GradientCase& c,
                                  const std::vector<Ellipsoid>& ellipsoids,
                                  const std::vector<double>& g,
                                  const std::vector<EllipsoidGradient>& gradients) {
  Random random(77);
  const double byKappa = random(-1.0, 1.0);
  double found = 0.0, expected = 0.0, tolerance = 0.0;
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    ParameterVector direction;
    for (double& d : direction) d = random(-1.0, 1.0);
    for (int n = 0; n < kParameters; ++n) found += gradients[i].byParameter[n] * direction[n];
    found += gradients[i].byKappa * byKappa;
    const Projection p = project(target, g, ellipsoids[i], direction, c.kappa, byKappa);
    expected += p.sum;
    tolerance += toleranceOf(c, ellipsoids[i]) * p.magnitude;
  }
  EXPECT_NEAR(found, expected, tolerance);
  EXPECT_GT(tolerance, 0.0) << "ellipsoids that no voxel sees prove nothing";
}

// ---- Intensities

class Intensities : public OnDevice {
 protected:
  [[nodiscard]] IntensityProblem problemOf(const Field& field, const IntensityTarget& target) {
    IntensityProblem problem(target, device_);
    problem.setShapes(field);
    return problem;
  }
};

inline Field someField() {
  return randomField(
      {.count = 12, .extent = 14.0, .smallest = 1.5, .aspect = 2.0, .origin = {6, 16, 11}});
}

/// A target in which every voxel is active.
inline IntensityTarget targetOf(const SparseVolume& volume) {
  return {volume, {.threshold = -1.0f}, activeBox(volume)};
}

TEST_P(Intensities, ThatMadeTheVolumeAreFound) {
  const Field truth = someField();
  const SparseVolume volume = revoxelise(truth, {});
  auto problem = problemOf(truth, targetOf(volume));
  std::vector<float> guess(truth.ellipsoidCount(), 0.1f);
  guess[3] = -0.1f;  // negative intensities are allowed then
  EXPECT_GT(problem.error(guess).squares, 1.0);
  // With 12 unknowns the result is exact after 12 steps, up to rounding in float32 sums over
  // bricks.
  EXPECT_LT(problem.solve(guess, 30), 1e-7);
  const auto& wanted = truth.chunks[0].ellipsoids.intensity;
  for (std::size_t i = 0; i < guess.size(); ++i) EXPECT_NEAR(guess[i], wanted[i], 1e-3) << i;
}

using Row = std::vector<double>;

/// Gaussian elimination in place. \return x with A x = b
inline Row solved(std::vector<Row> A, Row b) {
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

/// For each ellipsoid a field that has this ellipsoid alone, with an intensity of 1.
inline std::vector<Field> kernelsOf(const Field& field) {
  std::vector<Field> kernels(field.ellipsoidCount(), field);
  for (std::size_t i = 0; i < kernels.size(); ++i) {
    auto& intensity = kernels[i].chunks[0].ellipsoids.intensity;
    std::fill(intensity.begin(), intensity.end(), 0.0f);
    intensity[i] = 1.0f;
  }
  return kernels;
}

TEST_P(Intensities, AgreeWithDenseNormalEquations) {
  const Field field = someField();
  const SparseVolume volume = tubeVolume();
  auto problem = problemOf(field, targetOf(volume));
  std::vector<float> solution(field.ellipsoidCount(), -0.01f);
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
  // The loop visits all voxels of the volume and all that a support reaches.
  for (std::int32_t x = 0; x < 40; ++x)
    for (std::int32_t y = 0; y < 40; ++y)
      for (std::int32_t z = 0; z < 40; ++z) {
        const auto at = findBrick(volume, brickOf(Coord{x, y, z} - volume.origin));
        const int offset = voxelOffset(localOf({x, y, z}));
        add({x, y, z}, at ? double(volume.brickValues(*at)[std::size_t(offset)]) : 0.0);
      }
  const Row exact = solved(normal, right);
  // Sums over a brick are float32: an error of 1e-6 of sums of about 100, divided by curvatures of
  // about 10.
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_NEAR(solution[i], exact[i], 1e-4) << i;
    EXPECT_NEAR(problem.curvature()[i], normal[i][i], 1e-4 * normal[i][i]);
  }
}

/// A rule by which a reader makes some voxels inactive and clamps others.
struct ReaderRule {
  RevoxeliseOptions options{.threshold = 0.2f, .range = ValueRange{0.0f, 0.9f}};
  VoxelRule rule = makeVoxelRule(0.0f, options);
};

TEST_P(Intensities, HaveTheErrorThatAReaderGets) {
  const Field field = someField();
  const SparseVolume volume = tubeVolume();
  const ReaderRule rule;
  Box box = activeBox(volume);
  box.min.x += 3, box.max.z -= 5;  // the box cuts bricks
  const auto found = problemOf(field, {volume, rule.rule, box}).error(intensitiesOf(field));
  const auto metrics = compareVolumes(volume, revoxelise(field, rule.options), {.box = box});
  // Values are within 1e-6, errors up to 1, and the differences of about 20,000 voxels cancel.
  EXPECT_NEAR(found.squares, metrics.mseBox * metrics.boxVoxels, 1e-4);
  EXPECT_NEAR(found.largest, metrics.maxError, 1e-5);
}

TEST_P(Intensities, KeepTheirSignWhereThereIsOne) {
  const Field field = someField();
  const SparseVolume volume = tubeVolume();
  auto problem = problemOf(field, targetOf(volume));
  std::vector<float> intensities(field.ellipsoidCount(), 0.2f);
  const double before = problem.error(intensities).squares;
  EXPECT_LE(problem.solve(intensities, 20), before);
  for (const float i : intensities) EXPECT_GE(i, 0.0f);
}

TEST_P(Intensities, LeaveExactVoxelsAlone) {
  const Field field = someField();
  const SparseVolume volume = tubeVolume();
  // Nothing is active. Every voxel of the background is then exact, and others do not matter.
  IntensityTarget target = targetOf(volume);
  target.rule.threshold = 1e6f;
  auto passes = makeIntensityPasses(target, device_);
  passes->setShapes(field);
  IntensityGradient gradient;
  (void)passes->gradient(intensitiesOf(field), gradient);
  const std::vector<double> direction(field.ellipsoidCount(), 1.0);
  std::vector<double> some, all;
  passes->applyNormal(direction, some);
  target.rule.threshold = -1.0f;
  auto unrestricted = makeIntensityPasses(target, device_);
  unrestricted->setShapes(field);
  (void)unrestricted->gradient(std::vector<float>(direction.size(), 0.5f), gradient);
  unrestricted->applyNormal(direction, all);
  double sumSome = 0.0, sumAll = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_LE(some[i], all[i] * (1.0 + 1e-5)) << i;
    sumSome += some[i], sumAll += all[i];
  }
  EXPECT_LT(sumSome, 0.9 * sumAll);  // a large part of the field lies beside the tube
}

TEST_P(Intensities, DoNotDependOnTheFieldBefore) {
  const SparseVolume volume = tubeVolume();
  const Field field = someField();
  const Field other = randomField(
      {.count = 40, .extent = 60.0, .smallest = 2.0, .aspect = 3.0, .origin = {-9, 2, 5}});
  const IntensityTarget target = targetOf(volume);
  auto fresh = problemOf(field, target);
  auto used = problemOf(other, target);
  std::vector<float> a(field.ellipsoidCount(), 0.2f), b = a, c(other.ellipsoidCount(), 0.1f);
  (void)used.solve(c, 3);
  used.setShapes(field);
  EXPECT_EQ(fresh.solve(a, 10), used.solve(b, 10));
  EXPECT_EQ(a, b);
}

}  // namespace esvr::test
