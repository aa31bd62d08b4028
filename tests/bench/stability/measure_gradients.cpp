#include "stability.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/cpu/cpu_pass.h"

namespace esvr::bench {
namespace {

std::vector<EllipsoidGradient> gradientsOnCpu(const FitTarget& target, const Kernel& kernel,
                                              std::span<const Ellipsoid> ellipsoids) {
  constexpr double kSlack = 0.1;  // voxels
  CpuPass pass(target, kernelConstants<double>(kernel));
  pass.rebuild(ellipsoids, kSlack);
  std::vector<EllipsoidGradient> gradients(ellipsoids.size());
  pass.gradients(ellipsoids, gradients);
  return gradients;
}

/// The largest error of the derivatives of one ellipsoid; infinite if one is not finite.
double largestError(const EllipsoidGradient& found, const test::Differences& expected) {
  double largest = std::abs(found.byKappa - expected.by[kParameters]);
  for (int n = 0; n < kParameters; ++n) {
    const double error = std::abs(found.byParameter[std::size_t(n)] - expected.by[n]);
    if (!std::isfinite(error)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, error);
  }
  return std::isfinite(largest) ? largest : std::numeric_limits<double>::infinity();
}

/// The ellipsoids of a case, and others behind them.
std::vector<Ellipsoid> withCrowd(const test::GradientCase& c, const test::SmallTarget& target,
                                 std::size_t crowd) {
  std::vector<Ellipsoid> all = test::ellipsoidsOf(c, target);
  test::Random random(47);
  for (std::size_t n = 0; n < crowd; ++n) {
    Ellipsoid other = test::atAVoxel(c, random);
    other.intensity /= double(crowd);
    all.push_back(other);
  }
  return all;
}

}  // namespace

GradientErrors measureGradients(const test::GradientCase& c, std::size_t crowd,
                                const Device& device) {
  const test::SmallTarget target;
  const auto ellipsoids = withCrowd(c, target, crowd);
  const auto residuals = test::residualsOf(target, c, ellipsoids);
  const Kernel kernel{.kappa = c.kappa};
  const auto gradients = device.kind == DeviceKind::kCuda
                             ? gradientsOnGpu(target.get(), kernel, ellipsoids, device)
                             : gradientsOnCpu(target.get(), kernel, ellipsoids);
  GradientErrors errors;
  for (std::size_t i = 0; i < ellipsoids.size() - crowd; ++i) {
    const test::Differences expected = test::differencesOf(target, c, ellipsoids[i], residuals);
    const double error = largestError(gradients[i], expected) / expected.magnitude;
    const double bound = test::toleranceOf(c, ellipsoids[i]);
    errors.largest = std::max(errors.largest, error);
    errors.bound = std::max(errors.bound, bound);
    errors.shareOfBound = std::max(errors.shareOfBound, error / bound);
  }
  return errors;
}

}  // namespace esvr::bench
