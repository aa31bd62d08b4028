// Plan: all descriptions of one ellipsoid have no error, the errors of one scale and of a small turn
// are those of their formulas, and of the descriptions that have codes the nearest one is taken.

#include "codec/nearest_axes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "../field/random_field.h"

namespace esvr {
namespace {

using Logs = std::array<double, 3>;

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

/// A turn about one of the ellipsoid's axes.
Quaternion turnAbout(std::size_t axis, double angle) {
  Quaternion q{std::cos(angle / 2.0), 0.0, 0.0, 0.0};
  q[axis + 1] = std::sin(angle / 2.0);
  return q;
}

Ellipsoids randomSample() {
  return test::randomField({.count = 100, .smallest = 0.5, .aspect = 8.0, .seed = 4})
      .chunks[0]
      .ellipsoids;
}

/// The axes that are nearest to an ellipsoid's own rotation.
NearestAxes axesOf(const Ellipsoids& e, std::size_t i) { return {e, i, sortedAxes(e, i).rotation}; }

// Float32 rotations are of unit length to 2e-7, and the difference of two squared scales multiplies
// this by up to the aspect, 8. The error is the square of a few such terms.
constexpr double kNoError = 1e-10;

TEST(NearestAxes, HasNoErrorInItsOwnShapeAndUnderHalfTurns) {
  const Ellipsoids e = randomSample();
  for (std::size_t i = 0; i < e.size(); ++i) {
    const NearestAxes exact = axesOf(e, i);
    const auto& [logs, rotation] = exact.axes();
    EXPECT_LT(exact.squaredError(logs, rotation), kNoError);
    for (std::size_t a = 0; a < 3; ++a)
      EXPECT_LT(exact.squaredError(logs, product(rotation, turnAbout(a, std::numbers::pi))),
                kNoError);
  }
}

TEST(NearestAxes, HasNoErrorWithExchangedAxes) {
  const Ellipsoids e = randomSample();
  for (std::size_t i = 0; i < e.size(); ++i) {
    const NearestAxes exact = axesOf(e, i);
    for (std::size_t a = 0; a < 3; ++a) {
      auto [logs, rotation] = exact.axes();
      std::swap(logs[(a + 1) % 3], logs[(a + 2) % 3]);
      const Quaternion turned = product(rotation, turnAbout(a, std::numbers::pi / 2.0));
      EXPECT_LT(exact.squaredError(logs, turned), kNoError);
    }
  }
}

TEST(NearestAxes, HasTheSquaredErrorOfTheLogarithmOfOneScale) {
  const Ellipsoids e = randomSample();
  for (const double d : {0.001, -0.001, 0.02, -0.02})
    for (std::size_t a = 0; a < 3; ++a) {
      const NearestAxes exact = axesOf(e, a);
      auto [logs, rotation] = exact.axes();
      logs[a] += d;
      // (e^(-2 d) - 1)^2 / 4 is d^2 - 2 d^3 + ...; float32 rotations add 1e-6 to the root.
      const double root = std::expm1(-2.0 * d) / 2.0;
      EXPECT_NEAR(exact.squaredError(logs, rotation), root * root, 1e-5 * std::abs(d));
      EXPECT_NEAR(exact.squaredError(logs, rotation), d * d, 3.0 * std::abs(d * d * d) + 1e-8);
    }
}

TEST(NearestAxes, HasTheErrorOfASmallTurn) {
  Ellipsoids e;
  e.resize(1);
  e.logScale[0][0] = 1.5f, e.logScale[1][0] = 0.75f, e.logScale[2][0] = -0.5f;
  e.rotation[0][0] = 1.0f;
  const NearestAxes exact(e, 0, {1.0, 0.0, 0.0, 0.0});
  constexpr double kAngle = 1e-4;
  for (std::size_t a = 0; a < 3; ++a) {
    const Logs& logs = exact.axes().logScale;
    // Two entries of (s^2 - t^2) angle / (s t) = 2 sinh(log s - log t) angle, and a quarter of their
    // squares. Terms of the next order are smaller by about e^2 angle.
    const double entry = 2.0 * std::sinh(logs[(a + 1) % 3] - logs[(a + 2) % 3]) * kAngle;
    EXPECT_NEAR(exact.squaredError(logs, turnAbout(a, kAngle)) / (entry * entry / 2.0), 1.0, 0.01);
  }
}

TEST(NearestAxes, FitsItsOwnScalesAlongItsOwnRotation) {
  const Ellipsoids e = randomSample();
  for (std::size_t i = 0; i < e.size(); ++i) {
    const NearestAxes exact = axesOf(e, i);
    const Logs logs = exact.logScalesAlong(exact.axes().rotation);
    // The float32 rotation is of unit length to 2e-7 and the matrix squares it twice.
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(logs[a], exact.axes().logScale[a], 1e-6);
  }
}

TEST(NearestAxes, FitsScalesAlongAnotherRotationThatDecrease) {
  const Ellipsoids e = randomSample();
  for (std::size_t i = 0; i < e.size(); ++i) {
    const NearestAxes exact = axesOf(e, i);
    const Quaternion turned = product(exact.axes().rotation, turnAbout(2, std::numbers::pi / 2.0));
    // Along these axes the first two scales are exchanged, so that the smaller one comes first.
    const Logs logs = exact.logScalesAlong(turned);
    EXPECT_NEAR(logs[0], exact.axes().logScale[0], 1e-6);
    EXPECT_EQ(logs[0], logs[1]);
    EXPECT_GE(logs[1], logs[2]);
  }
}

TEST(NearestAxes, TakesTheRotationNearestToTheOneBefore) {
  // All components are below sqrt(1/2), so each of the half turns has codes.
  Ellipsoids e;
  e.resize(1);
  const Quaternion q{0.55, 0.5, 0.5, std::sqrt(1.0 - 0.55 * 0.55 - 0.5)};
  for (std::size_t a = 0; a < 4; ++a) e.rotation[a][0] = float(q[a]);
  for (std::size_t a = 0; a < 3; ++a) e.logScale[a][0] = 1.0f - float(a);
  for (std::size_t a = 0; a < 3; ++a) {
    Quaternion before = product(q, turnAbout(a, std::numbers::pi));
    if (before[0] < 0.0)
      for (double& c : before) c = -c;
    const NearestAxes nearest(e, 0, before);
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(nearest.axes().rotation[k], before[k], 1e-6);
  }
}

TEST(NearestAxes, TakesNoRotationWithoutCodes) {
  Ellipsoids e;
  e.resize(1);
  e.rotation[0][0] = 1.0f;
  for (std::size_t a = 0; a < 3; ++a) e.logScale[a][0] = 1.0f - float(a);
  const NearestAxes nearest(e, 0, turnAbout(0, std::numbers::pi));
  EXPECT_EQ(nearest.axes().rotation, (Quaternion{1.0, 0.0, 0.0, 0.0}));
}

}  // namespace
}  // namespace esvr
