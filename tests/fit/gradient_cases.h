#pragma once
/// The comparisons that gradients of a device must pass, for the ellipsoids of gradient_scene.h.

#include <gtest/gtest.h>

#include <vector>

#include "fit/gradient_scene.h"

namespace esvr::test {

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

}  // namespace esvr::test
