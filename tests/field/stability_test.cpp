// Plan: fields of all shapes, kernels and sizes are evaluated in float32 and measured. The difference
// must stay below the bound of the arithmetic, and the bound within a factor of what it bounds, so
// that it says something. A wrong evaluation, or one that is not finite, is found and named. The
// figures of small fields are known by hand: overlap, cancellation, correct digits, extremes and their
// centers.
// The float64 sum of a brick, which leaves out ellipsoids that are far away, is compared with the
// definition. The counts of terms and the bound are those of a field that is known by hand.
// The slope of the kernel is compared with differences in float64, and the largest slope of an
// interval with many slopes in it. If m is moved by any amount up to the bound of its error, phi must
// not change by more than its bound; this holds at the edge, at the end of the support, and for the
// paper's kernel, which jumps there. The bound of m is compared with float32 arithmetic.

#include "support/stability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "field/line_form.h"
#include "field/random_field.h"

namespace esvr::test {
namespace {

struct StabilityShape {
  const char* name;
  RandomFieldOptions field;
  KernelForm form = KernelForm::kContinuous;
};
std::ostream& operator<<(std::ostream& out, const StabilityShape& shape) {
  return out << shape.name;
}

Field fieldOfShape(const StabilityShape& shape) {
  Field field = randomField(shape.field);
  field.kernel.form = shape.form;
  return field;
}

class Rounding : public testing::TestWithParam<StabilityShape> {};

// The bound adds the largest errors of all operations, as if all had the same sign. A typical error is
// the square root of their number, some 10 times smaller, in a typical direction, which is again
// smaller: it reaches between 1/1000 and 1/2 of the bound.
TEST_P(Rounding, StaysWithinItsBound) {
  const Stability s = measureStability(fieldOfShape(GetParam()));
  EXPECT_GT(s.largest, 0.0) << "no rounding at all proves nothing";
  EXPECT_LT(s.shareOfBound, 1.0);
  EXPECT_GT(s.shareOfBound, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, Rounding,
    testing::Values(StabilityShape{"usual", {}},
                    StabilityShape{"needles", {.smallest = 0.1, .aspect = 1000.0}},
                    StabilityShape{"subvoxel", {.smallest = 0.1, .aspect = 2.0}},
                    StabilityShape{"huge", {.count = 2, .smallest = 150.0, .aspect = 2.0}},
                    StabilityShape{"gaussian", {.kappa = -30.0f}},
                    StabilityShape{"hard", {.smallest = 0.5, .kappa = 30.0f}},
                    StabilityShape{"box", {.smallest = 0.1, .kappa = 5000.0f}},
                    StabilityShape{"faint", {.intensity = 1e-30}},
                    StabilityShape{"bright", {.intensity = 1e30}},
                    StabilityShape{"crowd", {.count = 5000, .extent = 8.0, .smallest = 0.3}},
                    StabilityShape{"far", {.origin = {10'000'000, -10'000'000, 10'000'000}}},
                    StabilityShape{"farInItsChunk", {.extent = 4096.0}},
                    StabilityShape{"paper", {.kappa = 5.0f}, KernelForm::kPaper},
                    StabilityShape{"paperSoft", {.kappa = 0.5f}, KernelForm::kPaper}),
    [](const auto& shape) { return std::string(shape.param.name); });

// A float32 has 23 bits below its first one, and the smallest one is 2^-149. A sum of values near it is
// exact to a few of these.
TEST(Rounding, OfDenormalNumbersIsThatOfTheSmallestOnes) {
  const Stability s = measureStability(fieldOfShape({"", {.intensity = 1e-40}}));
  EXPECT_LT(s.shareOfBound, 1.0);
  EXPECT_LT(s.largest, 40 * 0x1p-149);
}

TEST(Stability, NamesTheVoxelOfAWrongValue) {
  const Coord wrong{10, 21, 33};
  const auto with = [&](float error) {
    return measureStability(
        fieldOfShape({"", {}}),
        {.evaluate = [&](const Field& f, std::span<const Coord> corners, std::span<float> out) {
          evaluateBricks(f, corners, out);
          const auto at = std::ranges::find(corners, brickOf(wrong) * kBrickSide) - corners.begin();
          out[std::size_t(at * kBrickVoxels + voxelOffset(localOf(wrong)))] += error;
        }});
  };
  const Stability s = with(0.5f);
  EXPECT_NEAR(s.largest, 0.5, 1e-4);
  EXPECT_EQ(s.at, wrong);
  EXPECT_NEAR(s.rms, 0.5 / std::sqrt(double(s.sampled) * kBrickVoxels), 1e-5);
  EXPECT_GT(s.shareOfBound, 100.0);
  EXPECT_TRUE(std::isinf(with(std::numeric_limits<float>::quiet_NaN()).largest));
}

/// Spheres with a support of less than three voxels, all with the same center.
Field spheresAtOneVoxel(std::initializer_list<float> intensities) {
  Field field = randomField({.count = intensities.size(), .extent = 1.0});
  Ellipsoids& e = field.chunks[0].ellipsoids;
  for (auto& center : e.center) std::ranges::fill(center, 3.0f);
  for (auto& scale : e.logScale) std::ranges::fill(scale, 0.0f);
  e.intensity = intensities;
  return field;
}

TEST(Stability, CountsOverlapAndCancellation) {
  const Stability one = measureStability(spheresAtOneVoxel({2.0f}));
  EXPECT_EQ(one.largestOverlap, 1u);
  EXPECT_EQ(one.cancellation, 1.0);
  EXPECT_NEAR(one.peak, 2.0, 1e-12);
  const Stability three = measureStability(spheresAtOneVoxel({2.0f, -1.0f, 1.0f}));
  EXPECT_EQ(three.largestOverlap, 3u);
  EXPECT_NEAR(three.cancellation, 2.0, 1e-12);
}

TEST(Stability, TakesSamplesEvenlyAndWhereTheExtremesAre) {
  const Stability s =
      measureStability(fieldOfShape({"", {.count = 300, .extent = 200.0}}), {.samples = 10});
  EXPECT_GT(s.sampled, 10u);
  EXPECT_LE(s.sampled, 14u);
}

// The reference.

// Both sums are in float64 and have the same terms, in the same order.
TEST(ReferenceBrick, IsTheDefinition) {
  Field field = randomField({.count = 40, .aspect = 30.0});
  field.background = 0.25f;
  field.chunks.push_back(randomField({.count = 10, .origin = {-5, 3, 9}, .seed = 3}).chunks[0]);
  const ReferenceField reference(field);
  for (const Coord corner : {Coord{0, 0, 0}, Coord{16, 24, 8}, Coord{-8, 0, 32}}) {
    const ReferenceBrick brick = reference.evaluate(corner);
    for (int v = 0; v < kBrickVoxels; v += 7)
      EXPECT_NEAR(field.background + brick.voxels[std::size_t(v)].sum,
                  evaluateReference(field, corner + voxelLocal(v)), 1e-14);
  }
}

TEST(ReferenceBrick, ListsWhatReachesIt) {
  Field field = randomField({.count = 1, .extent = 1.0, .smallest = 1.0, .aspect = 1.0});
  field.chunks[0].ellipsoids.intensity[0] = -2.0f;
  const ReferenceField reference(field);
  const ReferenceBrick near = reference.evaluate({0, 0, 0}), far = reference.evaluate({80, 0, 0});
  EXPECT_EQ(near.ellipsoids, 1u);
  EXPECT_EQ(near.largestIntensity, 2.0);
  EXPECT_EQ(near.voxels[0].count, 1u);
  EXPECT_EQ(near.voxels[0].magnitudes, -near.voxels[0].sum);
  EXPECT_EQ(near.voxels[std::size_t(voxelOffset({7, 7, 7}))].count, 0u);
  EXPECT_EQ(far.ellipsoids, 0u);
  EXPECT_EQ(far.voxels[0].sum, 0.0);
}

// A GPU rounds to units of the largest intensity too.
TEST(ReferenceBrick, HasALargerBoundForIntegerSums) {
  const Field field = randomField({.count = 40});
  const ReferenceField reference(field);
  const ReferenceBrick brick = reference.evaluate({16, 16, 16});
  EXPECT_GT(reference.bound(brick, 0, DeviceKind::kCuda),
            reference.bound(brick, 0, DeviceKind::kCpu));
  EXPECT_GT(reference.bound(brick, 0, DeviceKind::kCpu), 0.0);
}

// The bounds.

struct KernelCase {
  float kappa;
  KernelForm form = KernelForm::kContinuous;
};

class RoundingBound : public testing::TestWithParam<KernelCase> {
 protected:
  const KernelConstants<double> kernel_ =
      kernelConstants<double>({.form = GetParam().form, .kappa = GetParam().kappa});
};

TEST_P(RoundingBound, HasTheSlopeOfTheKernel) {
  constexpr double kStep = 1e-6;
  for (int n = 1; n < 100; ++n) {
    const double m = n / 100.0 * kernel_.cutoff;
    const double difference =
        (kernelPhi(kernel_, m - kStep) - kernelPhi(kernel_, m + kStep)) / (2 * kStep);
    // Differences of values up to 1 with errors of 2^-53, and of m with an error of 2^-53 kappa.
    EXPECT_NEAR(rounding::slopeAt(kernel_, m), difference,
                1e-8 + 1e-9 * std::abs(GetParam().kappa));
  }
}

TEST_P(RoundingBound, HasTheSteepestSlopeOfAnInterval) {
  Random random(3);
  for (int n = 0; n < 100; ++n) {
    const double from = random(0.0, kernel_.cutoff), to = random(from, kernel_.cutoff);
    const double steepest = rounding::steepest(kernel_, from, to);
    for (int i = 0; i <= 50; ++i)
      EXPECT_LE(rounding::slopeAt(kernel_, from + i / 50.0 * (to - from)), steepest * (1 + 1e-12));
  }
}

TEST_P(RoundingBound, CoversEveryErrorOfM) {
  Random random(5);
  for (const double error : {1e-6, 1e-3, 0.1, 2.0})
    for (int n = 0; n < 200; ++n) {
      const double m = random(0.0, 1.1 * kernel_.cutoff + error);
      const double bound = rounding::ofPhi(kernel_, m, error);
      for (const double off : {-error, random(-error, error), error}) {
        const double moved = kernelPhi(kernel_, std::max(0.0, m + off));
        EXPECT_LE(std::abs(moved - kernelPhi(kernel_, m)), bound) << m << " by " << off;
      }
    }
}

TEST_P(RoundingBound, IsNothingOutsideTheSupport) {
  EXPECT_EQ(rounding::ofPhi(kernel_, 1.01 * kernel_.cutoff + 1.0, 1e-6), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Kernels, RoundingBound,
                         testing::Values(KernelCase{-30.0f}, KernelCase{0.0f}, KernelCase{2.0f},
                                         KernelCase{30.0f}, KernelCase{5000.0f},
                                         KernelCase{5.0f, KernelForm::kPaper},
                                         KernelCase{0.5f, KernelForm::kPaper}));

/// m of an ellipsoid at a voxel, in the float32 arithmetic of a line.
float squaredInFloat(const LineForm& f, Coord voxel) {
  const float dx = float(voxel.x) - f.center[0], dz = float(voxel.z) - f.center[2];
  const float pzDz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
  const float t = distanceAlong(f, float(voxel.y), f.center[1], dx, dz);
  return squaredAt(f, closestSquared(f, dx, pzDz), t);
}

TEST(RoundingBoundOfM, CoversFloat32) {
  const Field field = randomField({.count = 200, .extent = 8.0, .smallest = 0.1, .aspect = 1000.0});
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  double largestShare = 0.0;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const Matrix3 L = unitFrame(e, i);
    const std::array<double, 3> center{e.center[0][i], e.center[1][i], e.center[2][i]};
    const LineForm form = makeLineForm(center, L, 1.0, 1.0);
    for (const Coord voxel : {Coord{0, 0, 0}, Coord{7, 1, 3}, Coord{2, 6, 5}}) {
      const double d[3] = {voxel.x - center[0], voxel.y - center[1], voxel.z - center[2]};
      double m = 0.0;
      for (int r = 0; r < 3; ++r)
        m += std::pow(L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2], 2);
      const double bound = rounding::ofM(rounding::columnLengths(L), d, m);
      const double error = std::abs(double(squaredInFloat(form, voxel)) - m);
      EXPECT_LE(error, bound);
      largestShare = std::max(largestShare, error / bound);
    }
  }
  EXPECT_GT(largestShare, 1e-3) << "a bound that is much too large says nothing";
}

}  // namespace
}  // namespace esvr::test
