// Plan: in the Gaussian limit the moments have closed forms; a harder kernel is wider.

#include "fit/kernel_moments.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace esvr {
namespace {

KernelMoments momentsOf(const Kernel& kernel) {
  return kernelMoments(kernelConstants<double>(kernel));
}

TEST(KernelMoments, AreThoseOfTheGaussian) {
  // e^-m has the mass pi^(3/2) and the variance 1/2 along each axis; what eps cuts off goes to zero
  // with it.
  const KernelMoments moments = momentsOf({.kappa = -30.0f, .epsilon = 1e-9f});
  EXPECT_NEAR(moments.variance, 0.5, 1e-4);
  EXPECT_NEAR(moments.mass, std::pow(std::numbers::pi, 1.5), 1e-4);
}

TEST(KernelMoments, AreLargerForAHarderKernel) {
  EXPECT_GT(momentsOf({.kappa = 5.0f}).variance, 0.8);
  EXPECT_GT(momentsOf({.kappa = 5.0f}).mass, momentsOf({.kappa = 2.0f}).mass);
}

}  // namespace
}  // namespace esvr
