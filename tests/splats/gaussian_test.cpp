// Plan: the optics of Gaussians are compared with sums over fine lattices and with closed forms. Tolerances are
// those of the sums.

#include "splats/gaussian.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace esvr::splats {
namespace {

TEST(SplatGaussian, HasTheIntegralAndTheSecondMomentOfItsKernel) {
  for (const float kappa : {-20.0f, 0.0f, 2.0f, 12.0f}) {
    const Kernel kernel{.kappa = kappa};
    const auto c = kernelConstants<double>(kernel);
    const double end = supportRadius(c), step = end / 40.0;
    double integral = 0.0, second = 0.0;
    for (double x = -end + step / 2; x < end; x += step)
      for (double y = -end + step / 2; y < end; y += step)
        for (double z = -end + step / 2; z < end; z += step) {
          const double phi = kernelPhi(c, x * x + y * y + z * z) * step * step * step;
          integral += phi;
          second += phi * x * x;
        }
    const auto [width, volume] = gaussianOf(kernel, double(kappa));
    EXPECT_NEAR(volume, integral, 2e-3 * integral) << kappa;
    EXPECT_NEAR(width, std::sqrt(second / integral), 2e-3 * width) << kappa;
  }
}

TEST(SplatGaussian, HasAClosedFormOfItsOwnIntegral) {
  const Kernel kernel = gaussianKernel();
  const double volume = gaussianOf(kernel, double(kernel.kappa)).volume;
  EXPECT_NEAR(gaussianVolume(), 2.0 * std::numbers::sqrt2 * volume, 1e-6);
  EXPECT_NEAR(gaussianVolume(), std::pow(2.0 * std::numbers::pi, 1.5), 0.05);  // less the cut
}

TEST(SplatGaussian, CastsTheMeanShadowOfItsProjections) {
  EXPECT_DOUBLE_EQ(meanShadow({2.0, 2.0, 2.0}), 4.0);
  EXPECT_NEAR(meanShadow({1.0, 1.0, 0.0}), 0.5, 1e-12);  // a disk
  for (const Sizes& s : {Sizes{1.0, 2.0, 3.0}, Sizes{0.01, 1.0, 1.0}, Sizes{5.0, 0.2, 0.1}}) {
    constexpr int kRings = 400, kTurns = 400;
    double sum = 0.0;
    for (int i = 0; i < kRings; ++i)
      for (int j = 0; j < kTurns; ++j) {
        const double z = (i + 0.5) / kRings, r = std::sqrt(1.0 - z * z);
        const double angle = (j + 0.5) / kTurns * std::numbers::pi / 2.0;
        sum += std::hypot(s[1] * s[2] * r * std::cos(angle), s[0] * s[2] * r * std::sin(angle),
                          s[0] * s[1] * z);
      }
    EXPECT_NEAR(meanShadow(s), sum / (kRings * kTurns), 1e-4 * meanShadow(s));
  }
}

TEST(SplatGaussian, HasADepthThatIsTheDilogarithmOfItsAlpha) {
  EXPECT_EQ(depthOfAlpha(0.0), 0.0);
  EXPECT_NEAR(depthOfAlpha(1.0), std::numbers::pi * std::numbers::pi / 6.0, 1e-15);
  for (const double alpha : {1e-4, 0.3, 0.5, 0.7, 0.99}) {
    constexpr double kStep = 1e-3;
    double sum = 0.0;
    for (double t = kStep / 2; t < 40.0; t += kStep)
      sum -= std::log1p(-alpha * std::exp(-t)) * kStep;
    EXPECT_NEAR(depthOfAlpha(alpha), sum, 1e-5 * sum) << alpha;
  }
}

TEST(SplatGaussian, IsFoundFromTheColumnsOfItsMatrix) {
  const Quaternion turn = normalised({0.3, -0.5, 0.7, 0.1});
  const Matrix3 R = rotationOf(turn);
  const Sizes sizes{3.0, 1.0, 0.01};
  Matrix3 columns;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) columns[3 * r + c] = R[3 * r + c] * sizes[c];
  const auto found = principalAxesOf(columns);
  const Matrix3 axes = rotationOf(found.rotation);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double wanted = 0.0, covariance = 0.0;
      for (int k = 0; k < 3; ++k) {
        wanted += columns[3 * i + k] * columns[3 * j + k];
        covariance += axes[3 * i + k] * axes[3 * j + k] * found.sizes[k] * found.sizes[k];
      }
      EXPECT_NEAR(covariance, wanted, 1e-12);
    }
  EXPECT_NEAR(found.sizes[2], 0.01, 1e-10);
  EXPECT_NEAR(lengthOf(found.rotation), 1.0, 1e-12);
  EXPECT_GE(found.rotation[0], 0.0);
}

}  // namespace
}  // namespace esvr::splats
