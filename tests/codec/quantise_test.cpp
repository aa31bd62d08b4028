// Plan: dequantised parameters are within half a step of the originals, sorted axes describe the
// same ellipsoid, and quantising dequantised values changes nothing.

#include "esvr/quantised.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../field/random_field.h"
#include "codec/lattice_bits.h"
#include "codec/sorted_axes.h"
#include "esvr/error.h"

namespace esvr {
namespace {

Ellipsoids sample(std::size_t n = 300, double aspect = 20.0) {
  Ellipsoids e =
      test::randomField({.count = n, .extent = 50.0, .smallest = 0.5, .aspect = aspect, .seed = 3})
          .chunks[0]
          .ellipsoids;
  test::Random random(5);
  for (float& intensity : e.intensity) intensity = float(std::exp(random(-6.0, 0.0)));
  return e;
}

/// The sum of phi^2 of a Gaussian is (pi / 2)^1.5 times its volume.
std::vector<double> curvatureOf(const Ellipsoids& e) {
  std::vector<double> c(e.size());
  for (std::size_t i = 0; i < c.size(); ++i)
    c[i] = 1.97 * std::exp(double(e.logScale[0][i]) + e.logScale[1][i] + e.logScale[2][i]);
  return c;
}

struct Rounded {
  QuantisedEllipsoids q;
  std::vector<std::size_t> order;
};
Rounded rounded(const Ellipsoids& e, double step) {
  Rounded r;
  r.q = quantise(e, chooseLattice(e, curvatureOf(e), {step, step, step, step}), r.order);
  return r;
}

/// Sigma^-1 = R S^-2 R^T, which does not depend on how an ellipsoid is described.
std::array<double, 9> precisionMatrix(const std::array<double, 3>& logScale,
                                      const std::array<double, 4>& q) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double R[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                          {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                          {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  std::array<double, 9> m{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t a = 0; a < 3; ++a)
        m[3 * r + c] += R[r][a] * R[c][a] * std::exp(-2.0 * logScale[a]);
  return m;
}

TEST(SortedAxes, NameTheSameEllipsoidInAnyOrder) {
  const Ellipsoids e = sample(200);
  const std::array<std::array<std::size_t, 3>, 6> orders{
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  for (std::size_t i = 0; i < e.size(); ++i) {
    Ellipsoids shuffled = e;
    const auto& order = orders[i % orders.size()];
    for (std::size_t a = 0; a < 3; ++a) shuffled.logScale[a][i] = e.logScale[order[a]][i];
    const SortedAxes axes = sortedAxes(shuffled, i);
    EXPECT_GE(axes.logScale[0], axes.logScale[1]);
    EXPECT_GE(axes.logScale[1], axes.logScale[2]);
    for (std::size_t a = 1; a < 4; ++a)
      EXPECT_GE(axes.rotation[0] + 1e-7, std::abs(axes.rotation[a]));
    const auto before =
        precisionMatrix({shuffled.logScale[0][i], shuffled.logScale[1][i], shuffled.logScale[2][i]},
                        {e.rotation[0][i], e.rotation[1][i], e.rotation[2][i], e.rotation[3][i]});
    const auto after = precisionMatrix(axes.logScale, axes.rotation);
    // The length of quaternions is 1 to within 2e-7, and entries reach e^(2 * 0.7) = 4.
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(after[k], before[k], 1e-5) << i;
  }
}

TEST(Quantise, KeepsEveryParameterWithinHalfItsStep) {
  const Ellipsoids e = sample();
  for (const double step : {0.3, 0.05, 0.005}) {
    const auto [q, order] = rounded(e, step);
    const Ellipsoids back = dequantise(q);
    ASSERT_TRUE(wellFormed(back));
    for (std::size_t i = 0; i < q.size(); ++i) {
      const CoarseScales s = coarseScales(q, i);
      const SortedAxes axes = sortedAxes(e, order[i]);
      const double place =
          std::ldexp(0.5 * q.lattice.cell, -positionBits(q.lattice, q.precision[i], s));
      const double scale =
          std::ldexp(0.5 * q.lattice.scaleStep, -scaleBits(q.lattice, q.precision[i]));
      const double intensity =
          std::ldexp(0.5 * q.lattice.intensityStep, -intensityShift(q.lattice, s));
      for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(back.center[a][i], e.center[a][order[i]], place + 1e-5);
        // A scale that rounding makes smaller than the one before it is cut off there, which adds
        // half a step.
        EXPECT_NEAR(back.logScale[a][i], axes.logScale[a], 2.0 * scale + 1e-6);
      }
      EXPECT_NEAR(back.intensity[i], e.intensity[order[i]], intensity * (1.0 + 1e-5));
    }
  }
}

TEST(Quantise, TurnsAnAxisByNoMoreThanItsBitsAllow) {
  const Ellipsoids e = sample();
  const auto [q, order] = rounded(e, 0.01);
  const Ellipsoids back = dequantise(q);
  for (std::size_t i = 0; i < q.size(); ++i) {
    const SortedAxes axes = sortedAxes(e, order[i]);
    double dot = 0.0;
    for (std::size_t c = 0; c < 4; ++c) dot += axes.rotation[c] * back.rotation[c][i];
    const int bits = rotationBits(q.lattice, q.precision[i], coarseScales(q, i));
    // Three components are within half a step each, and the largest one follows: the error is at
    // most twice the length of the first three.
    const double angle = 2.0 * std::sqrt(3.0) * std::ldexp(std::sqrt(0.5), -bits);
    if (bits > 2) {
      EXPECT_GT(dot, std::cos(angle) - 1e-6) << i;
    }
  }
}

TEST(Quantise, SpendsNoBitsOnTheRotationOfABall) {
  Ellipsoids e = sample(50, 1.0);
  const auto q = rounded(e, 0.05).q;
  const auto long_ = rounded(sample(50, 50.0), 0.05).q;
  int round = 0, stretched = 0;
  for (std::size_t i = 0; i < 50; ++i) {
    round += rotationBits(q.lattice, q.precision[i], coarseScales(q, i));
    stretched += rotationBits(long_.lattice, long_.precision[i], coarseScales(long_, i));
  }
  EXPECT_LT(3 * round, stretched);
}

TEST(Quantise, IsTheIdentityOnQuantisedValues) {
  const Ellipsoids e = sample();
  const auto choice = chooseLattice(e, curvatureOf(e), {0.05, 0.05, 0.05, 0.05});
  std::vector<std::size_t> order;
  const QuantisedEllipsoids once = quantise(e, choice, order);
  const QuantisedEllipsoids twice =
      quantise(dequantise(once), {once.lattice, once.precision}, order);
  EXPECT_EQ(once.position, twice.position);
  EXPECT_EQ(once.scale, twice.scale);
  EXPECT_EQ(once.intensity, twice.intensity);
}

TEST(Quantise, KeepsSigns) {
  Ellipsoids e = sample();
  for (std::size_t i = 0; i < e.size(); i += 2) e.intensity[i] = -e.intensity[i];
  const auto [q, order] = rounded(e, 0.01);
  const Ellipsoids back = dequantise(q);
  for (std::size_t i = 0; i < e.size(); ++i)
    EXPECT_EQ(std::signbit(back.intensity[i]), std::signbit(e.intensity[order[i]]));
}

TEST(Quantise, RefusesCentersThatNoLatticeHolds) {
  Ellipsoids e = sample(2);
  e.center[0][1] = 1e7f;
  EXPECT_THROW((void)rounded(e, 0.05), RuntimeFailure);
}

}  // namespace
}  // namespace esvr
