// Plan: dequantised parameters are within half a step of the originals, where the coordinates of a
// center and the components of a rotation follow the errors of those before them. Sorted axes
// describe the same ellipsoid, quantising dequantised values changes nothing, and numbers of bits
// agree with a float64 reference.

#include "esvr/quantised.h"

#include <gtest/gtest.h>

#include <cmath>

#include "codec/lattice.h"
#include "esvr/error.h"
#include "field/random_field.h"

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
      const SortedAxes axes = sortedAxes(e, order[i]);
      const double scale =
          std::ldexp(0.5 * q.lattice.scaleStep, -scaleBits(q.lattice, q.precision[i]));
      const double intensity =
          std::ldexp(0.5 * q.lattice.intensityStep, -intensityShift(q.lattice, coarseScales(q, i)));
      // A scale that rounding makes smaller than the one before it is cut off there, which adds
      // half a step.
      for (std::size_t a = 0; a < 3; ++a)
        EXPECT_NEAR(back.logScale[a][i], axes.logScale[a], 2.0 * scale + 1e-6);
      EXPECT_NEAR(back.intensity[i], e.intensity[order[i]], intensity * (1.0 + 1e-5));
    }
  }
}

TEST(Quantise, KeepsEachCoordinateWithinHalfItsStepOfItsTarget) {
  const Ellipsoids e = sample();
  std::size_t atTheEdge = 0;
  for (const double step : {0.3, 0.05, 0.005}) {
    const auto [q, order] = rounded(e, step);
    const Ellipsoids back = dequantise(q);
    for (std::size_t i = 0; i < q.size(); ++i) {
      const CoupledErrors errors = centerErrors(sortedAxes(e, order[i]));
      const AxisBits bits = shapeBits(q, i).position;
      std::array<double, 3> error{};
      for (std::size_t a = 0; a < 3; ++a) {
        error[a] = double(back.center[a][i]) - e.center[a][order[i]];
        const std::uint32_t last = (1u << (q.lattice.cellBits + bits[a])) - 1;
        if (q.position[a][i] == 0 || q.position[a][i] == last)
          ++atTheEdge;  // the lattice ends there
        else
          // centers of up to 50 have errors of up to 2e-6 each as float32
          EXPECT_NEAR(error[a], errors.shift(a, error), std::ldexp(0.5, -bits[a]) + 1e-4);
      }
    }
  }
  EXPECT_LT(atTheEdge, 50u);  // of 2700
}

TEST(Quantise, KeepsEachComponentOfARotationWithinHalfItsStepOfItsTarget) {
  const Ellipsoids e = sample();
  const auto [q, order] = rounded(e, 0.0003);
  const Ellipsoids back = dequantise(q);
  std::size_t atTheEdge = 0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    const SortedAxes axes = sortedAxes(e, order[i]);
    const CoupledErrors errors = rotationErrors(axes);
    const AxisBits bits = shapeBits(q, i).rotation;
    const int coarse = coarseRotationBits(q.lattice, q.precision[i], coarseScales(q, i));
    std::array<double, 3> error{};
    for (std::size_t a = 0; a < 3; ++a) {
      error[a] = double(back.rotation[a + 1][i]) - axes.rotation[a + 1];
      const int rest = bits[a] - coarse, below = Lattice::kMaxRotationBits - bits[a];
      const unsigned place = (q.rotation[a][i] >> below) & ((1u << rest) - 1u);
      if (place == 0 || place == (1u << rest) - 1u)
        ++atTheEdge;  // the interval of the coarse bits ends there
      else
        EXPECT_NEAR(error[a], errors.shift(a, error),
                    std::ldexp(0.5 * kRotationSide, -bits[a]) + 1e-5);
    }
  }
  EXPECT_LT(atTheEdge, 90u);  // of 900
}

/// The variance of each coordinate under the condition of those before it.
std::array<double, 3> conditional(const std::array<double, 9>& precision) {
  const auto& p = precision;
  const double lower = p[4] * p[8] - p[5] * p[7];
  const double all =
      p[0] * lower - p[1] * (p[3] * p[8] - p[5] * p[6]) + p[2] * (p[3] * p[7] - p[4] * p[6]);
  return {lower / all, p[8] / lower, 1.0 / p[8]};
}

TEST(LatticeBits, OfACenterAreThoseOfItsConditionalVariances) {
  const Ellipsoids e = sample();
  const auto [q, order] = rounded(e, 0.01);
  const Ellipsoids back = dequantise(q);
  for (std::size_t i = 0; i < q.size(); ++i) {
    const CoarseScales s = coarseScales(q, i);
    const double ball = (256.0 * q.precision[i] + q.lattice.positionBase -
                         q.lattice.positionSlope * double(s.low)) /
                            256.0 -
                        0.5;
    const auto variances = conditional(precisionMatrix(
        {back.logScale[0][i], back.logScale[1][i], back.logScale[2][i]},
        {back.rotation[0][i], back.rotation[1][i], back.rotation[2][i], back.rotation[3][i]}));
    const AxisBits bits = shapeBits(q, i).position;
    for (std::size_t a = 0; a < 3; ++a) {
      const double wanted = ball - 0.5 * std::log2(variances[a]) + back.logScale[2][i] * 1.442695;
      // rounding to whole bits, coarse scales (half a step of up to 0.7 octaves each), and
      // logarithms that are interpolated
      EXPECT_NEAR(bits[a], std::max(wanted, 0.0), 1.5) << i;
    }
  }
}

TEST(LatticeBits, AreFewerForAnEllipsoidThanForABall) {
  const auto total = [](double aspect) {
    const auto q = rounded(sample(300, aspect), 0.01).q;
    int bits = 0;
    for (std::size_t i = 0; i < q.size(); ++i) {
      const AxisBits position = shapeBits(q, i).position;
      // a ball of the smallest scale would have this many in each coordinate
      bits += 3 * ((256 * q.precision[i] + q.lattice.positionBase -
                    q.lattice.positionSlope * int(coarseScales(q, i).low)) >>
                   8);
      bits -= position[0] + position[1] + position[2];
    }
    return bits / 300.0;
  };
  EXPECT_GT(total(20.0), total(2.0) + 1.0);
}

TEST(CoupledErrors, MoveTheOthersToTheLeastWeightedError) {
  const Ellipsoids e = sample(50);
  for (std::size_t i = 0; i < e.size(); ++i) {
    const SortedAxes axes = sortedAxes(e, i);
    const auto p = precisionMatrix(axes.logScale, axes.rotation);
    const CoupledErrors errors = centerErrors(axes);
    const auto slope = [&](std::size_t a, const std::array<double, 3>& d) {
      return p[3 * a] * d[0] + p[3 * a + 1] * d[1] + p[3 * a + 2] * d[2];
    };
    std::array<double, 3> d{0.3, 0.0, 0.0};
    d[1] = errors.shift(1, d);
    d[2] = errors.shift(2, d);
    // quaternions have unit length to within 2e-7
    const double tolerance = 1e-6 * std::exp(-2.0 * axes.logScale[2]);
    EXPECT_NEAR(slope(1, d), 0.0, tolerance);
    EXPECT_NEAR(slope(2, d), 0.0, tolerance);
    d[1] += 0.2;  // an error of coordinate 1 moves coordinate 2 again
    d[2] = errors.shift(2, d);
    EXPECT_NEAR(slope(2, d), 0.0, tolerance);
  }
}

TEST(Quantise, SpendsNoBitsOnTheRotationOfABall) {
  const auto q = rounded(sample(50, 1.0), 0.05).q;
  const auto long_ = rounded(sample(50, 50.0), 0.05).q;
  const auto bitsOf = [](const QuantisedEllipsoids& all) {
    int bits = 0;
    for (std::size_t i = 0; i < all.size(); ++i)
      for (const int component : shapeBits(all, i).rotation) bits += component;
    return bits;
  };
  EXPECT_LT(3 * bitsOf(q), bitsOf(long_));
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
