#include "fit/kernel_moments.h"

#include <numbers>

namespace esvr {

KernelMoments kernelMoments(const KernelConstants<double>& kernel) {
  constexpr int kSteps = 400;
  const double radius = supportRadius(kernel);
  double mass = 0.0, second = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double q = radius * (i + 0.5) / kSteps;
    const double weight = kernelPhi(kernel, q * q) * q * q;
    mass += weight;
    second += weight * q * q / 3.0;
  }
  return {4.0 * std::numbers::pi * radius / kSteps * mass, second / mass};
}

}  // namespace esvr
