#pragma once
/// Compares the analytic gradients of a device with differences in float64.

#include <span>
#include <vector>

#include "esvr/device.h"
#include "fit/gradient_scene.h"

namespace esvr::bench {

struct GradientErrors {
  /// Largest error of a derivative, divided by the sum of the magnitudes of the terms of the largest
  /// derivative of its ellipsoid.
  double largest = 0.0;
  double bound = 0.0;         ///< the largest that the arithmetic allows
  double shareOfBound = 0.0;  ///< largest error divided by its own bound
};

/// Measures the gradients of four ellipsoids.
/// \param crowd  ellipsoids of the same shapes that are added to the sum, as faint as they are many
[[nodiscard]] GradientErrors measureGradients(const test::GradientCase& gradientCase,
                                              std::size_t crowd, const Device& device);

/// The gradients of 1/2 sum r^2 on a GPU.
/// \throws DeviceError  the build has no CUDA
[[nodiscard]] std::vector<EllipsoidGradient> gradientsOnGpu(const FitTarget& target,
                                                            const Kernel& kernel,
                                                            std::span<const Ellipsoid> ellipsoids,
                                                            const Device& device);

}  // namespace esvr::bench
